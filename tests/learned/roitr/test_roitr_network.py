# SPDX-License-Identifier: MIT
"""RoITr as a network: fused codes, invariance, learning, weights on disk."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from bushes import bush
from measured import peak_and_estimate

from hybridreg.geometry import se3
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.memory_estimate import SLACK
from hybridreg.learned.roitr.batch import RoitrBatch
from hybridreg.learned.roitr.config import RoitrConfig, named_config
from hybridreg.learned.roitr.local_attention import LocalAttention
from hybridreg.learned.roitr.losses import right_shares
from hybridreg.learned.roitr.network import RoitrNetwork
from hybridreg.learned.roitr.official_names import official_name, unused_names
from hybridreg.learned.roitr.point_levels import build_levels
from hybridreg.learned.roitr.superpoint_pairs import match_adaptively
from hybridreg.learned.roitr.targets import compute_targets

NANO = named_config("nano")


def made(config: RoitrConfig = NANO, seed: int = 0) -> RoitrNetwork:
    torch.manual_seed(seed)
    return RoitrNetwork(config).eval()


@pytest.mark.parametrize(
    ("n", "k", "dims", "heads"), [(40, 8, (6, 16, 12), 4), (1, 1, (3, 6, 5), 3), (25, 16, (12, 12, 12), 2)]
)
def test_fused_codes_are_the_codes(n: int, k: int, dims: tuple[int, int, int], heads: int) -> None:
    torch.manual_seed(0)
    layer = LocalAttention(*dims, heads)
    features = torch.randn(n + 3, dims[0])
    rows, ppf = torch.randint(0, n + 3, (n, k)), torch.rand(n, k, 4) * 3
    outputs, gradients = [], []
    for fused in (True, False):
        layer.fused = fused
        layer.zero_grad()
        out = layer(features, torch.arange(n), rows, ppf)
        out.square().sum().backward()
        outputs.append(out.detach())
        gradients.append(torch.cat([p.grad.flatten() for p in layer.parameters() if p.grad is not None]))
    assert torch.allclose(*outputs, atol=1e-5)
    assert torch.allclose(*gradients, atol=1e-4 * float(gradients[1].abs().max()))
    assert all(p.grad is not None for p in layer.parameters())


def test_features_do_not_change_with_the_pose() -> None:
    batch, _ = bush(0, NANO, noise=0.0)
    with torch.no_grad():
        target, source = made().encode(batch)
    assert torch.allclose(target.point_features, source.point_features, atol=1e-3)
    # The cross layers of both clouds differ by their order alone: the source's is first.
    assert (target.node_features * source.node_features).sum(1).min() > 0.9


def test_the_source_goes_first() -> None:
    batch, _ = bush(0, NANO)
    with torch.no_grad():
        one = made().encode(batch)
        two = made().encode(RoitrBatch(target=batch.source, source=batch.target))
    assert not torch.allclose(one.target.node_features, two.source.node_features, atol=1e-4)
    assert torch.allclose(one.target.point_features, two.source.point_features, atol=1e-6)


@pytest.mark.parametrize("n", [4, 20])
def test_a_handful_of_points_goes_through(n: int) -> None:
    batch, truth = bush(1, NANO, n=n)
    network = made()
    with torch.no_grad():
        output = network(batch)
    assert torch.isfinite(output.target.node_features).all()
    assert torch.isfinite(output.matches.weight).all()
    losses = network.losses(output, compute_targets(batch, truth, NANO))
    assert torch.isfinite(losses.total)


def test_thirty_rounds_overfit_four_pairs() -> None:
    config = dataclasses.replace(
        NANO,
        matching=dataclasses.replace(NANO.matching, matching_radius=0.3, superpoint_matches=8, topk=1),
        loss=dataclasses.replace(NANO.loss, positive_radius=0.3),
    )
    pairs = [bush(seed, config) for seed in range(4)]
    targets = [
        compute_targets(batch, truth, config, torch.Generator().manual_seed(0)) for batch, truth in pairs
    ]
    network = made(config)
    optimiser = torch.optim.Adam(network.parameters(), lr=1e-3, betas=(0.9, 0.99))
    history = []
    for _ in range(30):
        for (batch, _), target in zip(pairs, targets, strict=True):
            losses = network.losses(network.encode(batch), target)
            optimiser.zero_grad()
            losses.total.backward()
            optimiser.step()
            history.append([float(losses.coarse.detach()), float(losses.fine.detach())])
    first, last = np.mean(history[:4], axis=0), np.mean(history[-4:], axis=0)
    assert last[0] < 0.65 * first[0]
    assert last[1] < 0.7 * first[1]
    shares = [
        right_shares(network(batch), target, 0.3) for (batch, _), target in zip(pairs, targets, strict=True)
    ]
    assert np.mean(shares, axis=0).min() > 0.85


def test_sizes_by_name() -> None:
    assert sum(p.numel() for p in RoitrNetwork.named("small").parameters()) <= 3_000_000
    # The published ones less occ_proj and the first of two transports, which nothing reads.
    assert sum(p.numel() for p in RoitrNetwork.named("roitr-3dmatch").parameters()) == 10_102_531 - 257 - 1
    assert (
        len(RoitrNetwork.named("roitr-4dmatch").state_dict())
        + len(unused_names(RoitrNetwork.named("roitr-4dmatch").state_dict()))
        == 522
    )
    with pytest.raises(KeyError, match="known are nano, small, roitr-3dmatch, roitr-4dmatch"):
        named_config("full")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"widths": (8, 16)}, "one value for each"),
        ({"strides": (2, 4, 4)}, r"strides\[0\]=2 must be 1"),
        ({"heads": 3}, "divisible by heads 3"),
        ({"neighbors": (0, 8, 8)}, "neighbors"),
        (
            {"transformer": dataclasses.replace(NANO.transformer, blocks=("cross", "self"))},
            "begin with 'self'",
        ),
    ],
)
def test_impossible_plans_are_refused(fields: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(NANO, **fields)  # type: ignore[arg-type]


def official(network: RoitrNetwork) -> dict[str, torch.Tensor]:
    state = {official_name(name): tensor for name, tensor in network.state_dict().items()}
    return state | {name: torch.zeros(1) for name in unused_names(network.state_dict())}


@pytest.mark.parametrize(
    "wrap", [lambda s: {"epoch": 3, "state_dict": {f"module.{n}": t for n, t in s.items()}}, lambda s: s]
)
def test_a_checkpoint_of_the_authors_loads(tmp_path: Path, wrap) -> None:  # type: ignore[no-untyped-def]
    network = made(named_config("roitr-3dmatch"), seed=4)
    torch.save(wrap(official(network)), tmp_path / "model.pth")
    loaded = RoitrNetwork.load_official(tmp_path / "model.pth")
    assert not loaded.training
    assert loaded.config == named_config("roitr-3dmatch")
    assert all(torch.equal(t, loaded.state_dict()[n]) for n, t in network.state_dict().items())


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.pop("backbone.dec2.1.bn2.weight"), "is missing"),
        (lambda s: s.pop("OT.alpha"), "OT.alpha is missing"),
        (lambda s: s.update(extra=torch.zeros(1)), "extra is not part of this network"),
        (lambda s: s.update({"fine_proj.bias": torch.zeros(7)}), "has shape"),
        (lambda s: s["coarse_proj.bias"].fill_(float("nan")), "not finite"),
    ],
)
def test_a_wrong_checkpoint_is_told(tmp_path: Path, change, message: str) -> None:  # type: ignore[no-untyped-def]
    state = official(made())
    change(state)
    torch.save(state, tmp_path / "wrong.pth")
    with pytest.raises(ValueError, match=message):
        RoitrNetwork.load_official(tmp_path / "wrong.pth", "nano")


def test_what_is_saved_comes_back(tmp_path: Path) -> None:
    network = made()
    network.save_pretrained(tmp_path)
    assert json.loads((tmp_path / "config.json").read_text())["network"] == "roitr"
    again = RoitrNetwork.from_pretrained(tmp_path)
    assert again.config == network.config
    assert all(torch.equal(t, again.state_dict()[n]) for n, t in network.state_dict().items())
    with pytest.raises(ValueError, match="weights of the network 'roitr', not of 'cross3dreg'"):
        RegistrationNetwork.from_pretrained(tmp_path)
    values = json.loads((tmp_path / "config.json").read_text())
    (tmp_path / "config.json").write_text(json.dumps({**values, "network": "vrhcf"}))
    with pytest.raises(ValueError, match="of the network 'vrhcf', not of 'roitr'"):
        RoitrNetwork.from_pretrained(tmp_path)
    (tmp_path / "config.json").write_text(json.dumps({**values, "width": 3}))
    with pytest.raises(ValueError, match="unknown keys"):
        RoitrNetwork.from_pretrained(tmp_path)


def test_adaptive_matching_takes_all_that_are_near_or_the_nearest() -> None:
    unit = torch.nn.functional.normalize(torch.randn(6, 4, generator=torch.Generator().manual_seed(0)), dim=1)
    distance = (unit[:, None] - unit[None]).norm(dim=2)
    found = match_adaptively(unit, unit, 2, 1.0)
    assert list(zip(found.target.tolist(), found.source.tolist(), strict=True)) == [
        tuple(p) for p in (distance <= 1.0).nonzero().tolist()
    ]
    few = match_adaptively(unit, unit, 20, 0.0)
    assert len(few) == 20
    assert torch.allclose(few.score, few.score.sort(descending=True).values)


_MADE = """
from hybridreg.learned.roitr.batch import make_batch
from hybridreg.learned.roitr.network import RoitrNetwork
network = RoitrNetwork.named("small")
clouds = [rng.uniform(0, 70, (12000, 3)) * [1, 1, 0.02] for _ in range(2)]
batch = make_batch(*clouds, network.config)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is reset through /proc")
def test_the_memory_estimate_is_near_and_not_below() -> None:
    real, estimate = peak_and_estimate(_MADE)
    assert real <= estimate - SLACK <= 1.5 * real


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")
def test_devices_agree() -> None:
    batch, _ = bush(0, NANO)
    network = made()
    expected = network(batch).target
    got = network.to("cuda")(batch.to("cuda")).target
    assert torch.allclose(got.node_features.cpu(), expected.node_features, atol=1e-3)
    assert torch.allclose(got.point_features.cpu(), expected.point_features, atol=1e-3)


def test_levels_do_not_hang_on_the_frame() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform(-3, 3, (200, 3)).astype(np.float32)
    normals = np.tile(np.float32([0, 0, 1]), (200, 1))
    R = se3.random_rotation(rng).astype(np.float32)
    one, two = build_levels(points, normals, NANO), build_levels(points @ R.T, normals @ R.T, NANO)
    assert all(torch.equal(a, b) for a, b in zip(one.picked, two.picked, strict=True))
