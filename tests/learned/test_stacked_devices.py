# SPDX-License-Identifier: MIT
"""Predator and CoFiNet on every device that this machine has, and with a card's form of the convolution on the CPU."""

from __future__ import annotations

from typing import Any

import pytest
import torch
from four_pairs import four_pairs

from hybridreg.learned.cofinet.network import CofinetNetwork
from hybridreg.learned.cofinet.targets import compute_targets as cofinet_targets
from hybridreg.learned.geotransformer import kpconv_fpn
from hybridreg.learned.layers.dense_influence import DenseLinks
from hybridreg.learned.predator.network import PredatorNetwork
from hybridreg.learned.predator.targets import compute_targets as predator_targets

DEVICES = [
    "dense",
    pytest.param("cuda", marks=pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")),
]


def run(cls: Any, device: str) -> dict[str, torch.Tensor]:
    """Outputs, losses and a gradient of one pair on a device, back on the CPU."""
    torch.manual_seed(0)
    network = cls(cls.named_config("nano")).to(device)
    pair = four_pairs(network.config, points=400, extent=8.0)[0]
    batch = pair.batch.to(device)
    compute = predator_targets if cls is PredatorNetwork else cofinet_targets
    targets = compute(batch.pyramid, pair.transform, network.config, torch.Generator().manual_seed(0))
    losses = network.losses(network(batch) if cls is PredatorNetwork else network.encode(batch), targets)
    losses.total.backward()
    with torch.no_grad():
        out = network.eval()(batch)
    found = {"loss": losses.total.detach(), "gradient": network.encoder.blocks[1].conv.weights.grad}
    if cls is PredatorNetwork:
        found |= {"features": out.source.features, "overlap": out.target.overlap}
    else:
        found |= {"assignment": out.encoding.log_assignment, "features": out.encoding.source.point_features}
    return {name: value.cpu() for name, value in found.items()}


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("cls", [PredatorNetwork, CofinetNetwork])
def test_devices_agree(cls: Any, device: str, monkeypatch: pytest.MonkeyPatch) -> None:
    expected = run(cls, "cpu")
    if device == "dense":
        monkeypatch.setattr(
            kpconv_fpn, "_links", lambda q, s, n, cylindrical, exact: DenseLinks.find(q, s, n)
        )
    got = run(cls, "cpu" if device == "dense" else device)
    for name, value in expected.items():
        assert torch.allclose(got[name].double(), value.double(), atol=1e-3), name
    assert float(expected["gradient"].abs().max()) > 0
