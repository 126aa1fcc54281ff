# SPDX-License-Identifier: MIT
"""The same network on every device that this machine has: forward pass, training step, searches."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from hybridreg.learned.cross3dreg.batch import make_batch
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.sizes import named_config
from hybridreg.learned.cross3dreg.targets import compute_targets
from hybridreg.learned.cross3dreg.training_step import training_losses

DEVICES = [
    "cpu",
    pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")),
]
CONFIG = named_config("nano", omp=True, vgam=True)


def run(device: str, pair: tuple[np.ndarray, np.ndarray]) -> dict[str, torch.Tensor]:
    """Features, overlap and gradients of one pair on a device, back on the CPU."""
    torch.manual_seed(0)
    network = RegistrationNetwork(CONFIG).to(device).eval()
    image = np.random.default_rng(0).integers(0, 255, (72, 128, 3), dtype=np.uint8)
    batch = make_batch(*pair, CONFIG, image=image, device=device)
    targets = compute_targets(batch.pyramid, torch.eye(4), CONFIG)
    training_losses(network, batch, targets, torch.Generator().manual_seed(0)).total.backward()
    with torch.no_grad():
        out = network(batch)
    assert out.overlap is not None
    return {
        "points": batch.pyramid.points[-1].cpu(),
        "links": (batch.pyramid.neighbors[0] < len(batch.pyramid.points[0])).sum(1).cpu(),
        "fine": out.encoding.target.point_features.cpu(),
        "overlap": out.overlap.target.cpu(),
        "gradient": network.backbone.encoder[1][0].conv.weights.grad.cpu(),
    }


@pytest.mark.parametrize("device", DEVICES)
def test_devices_agree(device: str, pair: tuple[np.ndarray, np.ndarray]) -> None:
    expected, got = run("cpu", pair), run(device, pair)
    for name, value in expected.items():
        assert torch.allclose(got[name].double(), value.double(), atol=1e-3), name
    assert float(expected["gradient"].abs().max()) > 0
