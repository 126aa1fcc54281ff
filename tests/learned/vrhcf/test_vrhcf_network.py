# SPDX-License-Identifier: MIT
"""SphereNet as a network: both paddings, learning, matching, weights on disk."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from measured import peak_and_estimate
from streets import moved, street, yaw

from hybridreg.learned.vrhcf.config import ShellConv, SphereNetConfig, SurfaceConv, named_config
from hybridreg.learned.vrhcf.cost import SLACK, multiply_adds
from hybridreg.learned.vrhcf.keypoint_matching import match_descriptors
from hybridreg.learned.vrhcf.losses import hardest_in_batch
from hybridreg.learned.vrhcf.network import SphereNet, pad_sphere
from hybridreg.learned.vrhcf.official_names import UNUSED, official_names
from hybridreg.learned.vrhcf.targets import training_batch

NANO = named_config("nano")


def made(config: SphereNetConfig = NANO, seed: int = 0) -> SphereNet:
    torch.manual_seed(seed)
    return SphereNet(config).eval()


@pytest.mark.parametrize(("padding", "around"), [("right", 3), ("released", 4)])
def test_a_roll_around_the_wrapped_axis_changes_nothing(padding: str, around: int) -> None:
    network = made(dataclasses.replace(NANO, padding=padding))  # type: ignore[arg-type]
    x = torch.rand(2, 1, NANO.radial, NANO.azimuth, NANO.elevation)
    with torch.no_grad():
        whole = network.surface(x).amax((2, 3))
        same, other = (network.surface(x.roll(2, dims=dim)).amax((2, 3)) for dim in (around, 7 - around))
    assert torch.allclose(whole, same, atol=1e-6)
    assert not torch.allclose(whole, other, atol=1e-5)


@pytest.mark.parametrize("reach", [1, 2, 3, 5, 4, 17])
def test_padding_keeps_an_odd_kernels_size(reach: int) -> None:
    x = torch.arange(12.0).view(1, 1, 4, 3)
    padded = pad_sphere(x, reach, wraps_azimuth=True)
    extra = reach // 2 if reach % 2 == 0 else reach - 1
    assert padded.shape == (1, 1, 4 + extra, 3 + extra)
    before = 0 if reach % 2 == 0 else (reach - 1) // 2
    assert torch.equal(padded[0, 0, before : before + 4, before : before + 3], x[0, 0])
    if reach == 3:
        assert torch.equal(padded[0, 0, 0, 1:-1], x[0, 0, -1])
        assert (padded[..., 0] == 0).all()


def test_parts_of_a_cloud_are_described_alike() -> None:
    patches = torch.randn(37, NANO.patch_points, 3)
    network = made()
    with torch.no_grad():
        whole = network.describe(patches)
        assert torch.allclose(whole[20:], network.describe(patches[20:]), atol=1e-5)
        assert network.describe(patches[:0]).shape == (0, NANO.width)


def test_descriptors_do_not_change_with_the_pose_of_cloud_and_sensor() -> None:
    rng = np.random.default_rng(0)
    patches = (
        rng.normal(size=(12, NANO.patch_points, 3)) * [1.0, 0.8, 0.1] * 2.0 + rng.normal(size=(12, 1, 3)) * 9
    )
    # A whole number of azimuth cells about the patches' own axis is not what a rotation is: only nearly the same.
    R = yaw(90.0)[:3, :3]
    with torch.no_grad():
        one, two = (made().describe(torch.from_numpy(p).float()) for p in (patches, patches @ R.T))
    assert torch.nn.functional.cosine_similarity(one, two).min() > 0.98


def test_two_dozen_rounds_overfit_four_pairs() -> None:
    config = dataclasses.replace(NANO, loss_pairs=12, pair_radius=0.25)
    batches = []
    for seed in range(4):
        scene = street(seed, 1500, 8.0)
        truth = yaw(30.0 * seed, (1.0, 0.0, 0.5))
        source = moved(scene[300:], np.linalg.inv(truth))
        batches.append(training_batch(scene[:1200], source, truth, config, seed))
        assert len(batches[-1][1].source) == 12
    network = made(config).train()
    optimiser = torch.optim.Adam(network.parameters(), lr=1e-3)
    history = []
    for _ in range(24):
        for batch, targets in batches:
            losses = network.losses(network(batch), targets)
            optimiser.zero_grad()
            losses.total.backward()
            optimiser.step()
            history.append([float(losses.total.detach()), float(losses.accuracy)])
    first, last = np.mean(history[:4], axis=0), np.mean(history[-4:], axis=0)
    assert last[0] < 0.6 * first[0]
    assert last[1] > max(0.9, first[1])


def test_the_loss_is_a_hinge_on_the_hardest() -> None:
    anchors = torch.tensor([[1.0, 0.0], [0.0, 1.0]])
    right = hardest_in_batch(anchors, anchors, 0.1, 1.4)
    assert float(right.total) == pytest.approx(0.0, abs=1e-6)
    assert float(right.accuracy) == 1.0
    wrong = hardest_in_batch(anchors, anchors.flip(0), 0.1, 1.4)
    assert float(wrong.total) == pytest.approx(2.0**0.5 - 0.1 + 1.4, abs=1e-5)
    assert float(wrong.accuracy) == 0.0
    assert float(hardest_in_batch(anchors[:1], anchors[:1], 0.1, 1.4).total) == 0.0


def test_matching_as_released_lets_long_descriptors_win() -> None:
    source, target = (
        torch.tensor([[1.0, 0.0], [0.0, 1.0]]),
        torch.tensor([[0.9, 0.1], [0.0, 1.0], [8.0, 6.0]]),
    )
    assert match_descriptors(source, target, "unit").tolist() == [0, 1]
    assert match_descriptors(source, target, "channels").tolist() == [2, 2]


def test_sizes_by_name() -> None:
    assert sum(p.numel() for p in SphereNet.named("small").parameters()) <= 3_000_000
    published = SphereNet.named("vrhcf-3dmatch")
    assert sum(p.numel() for p in published.parameters()) == 2_241_104 - 128  # less what nothing reads
    assert multiply_adds(published.config) == pytest.approx(2.88e9, rel=2e-3)
    assert (published.config.padding, published.config.frames, published.config.matching) == (
        "released",
        "released",
        "channels",
    )
    with pytest.raises(KeyError, match="known are nano, small, vrhcf-3dmatch"):
        named_config("full")


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"radial": 9}, "leave 5 of radial=9"),
        ({"shells": (ShellConv(width=2, kernel=7),)}, "leave -1 of radial=5"),
        ({"surface": ()}, "one convolution at least"),
        ({"radius": 0.0}, "radius"),
        ({"patch_points": 1}, "patch_points"),
    ],
)
def test_impossible_plans_are_refused(fields: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(NANO, **fields)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="dilation"):
        SurfaceConv(width=3, dilation=0)


def official(network: SphereNet) -> dict[str, torch.Tensor]:
    names = official_names(network)
    state = {names[name]: tensor for name, tensor in network.state_dict().items()}
    return {f"module.{name}": t for name, t in {**state, **{n: torch.zeros(1) for n in UNUSED}}.items()}


def test_a_checkpoint_of_the_authors_loads_strictly(tmp_path: Path) -> None:
    network = made(named_config("vrhcf-3dmatch"), seed=3)
    state = official(network)
    torch.save(state, tmp_path / "3DMatch_best.pkl")
    loaded = SphereNet.load_official(tmp_path / "3DMatch_best.pkl")
    assert all(torch.equal(t, loaded.state_dict()[n]) for n, t in network.state_dict().items())
    assert loaded.config.padding == "released"
    right = dataclasses.replace(named_config("vrhcf-3dmatch"), padding="right")
    assert SphereNet.load_official(tmp_path / "3DMatch_best.pkl", right).config.padding == "right"
    for change, message in (
        (lambda s: s.pop("module.xyz_raising.bias"), "xyz_raising.bias is missing"),
        (lambda s: s.pop("module.conv_net.ops.37.weight"), "is missing"),
        (lambda s: s.update(more=torch.zeros(1)), "more is not part of this network"),
        (lambda s: s.update({"module.conv_net.ops.0.weight": torch.zeros(2)}), "has shape"),
    ):
        spoiled = dict(state)
        change(spoiled)
        torch.save(spoiled, tmp_path / "wrong.pkl")
        with pytest.raises(ValueError, match=message):
            SphereNet.load_official(tmp_path / "wrong.pkl")


def test_what_is_saved_comes_back(tmp_path: Path) -> None:
    network = made()
    network.save_pretrained(tmp_path)
    assert json.loads((tmp_path / "config.json").read_text())["network"] == "vrhcf"
    again = SphereNet.from_pretrained(tmp_path)
    assert again.config == network.config
    patches = torch.randn(5, NANO.patch_points, 3)
    with torch.no_grad():
        assert torch.equal(network.describe(patches), again.describe(patches))


def test_one_batch_of_training_is_enough_to_be_trained() -> None:
    network = made()
    assert network.untrained() == {"layers"}
    network.train().describe(torch.randn(3, NANO.patch_points, 3))
    assert network.untrained() == frozenset()


_MADE = """
from hybridreg.learned.vrhcf.batch import SphereBatch
from hybridreg.learned.vrhcf.network import SphereNet
network = SphereNet.named("small")
patches = torch.randn(64, network.config.patch_points, 3)
batch = SphereBatch(target=patches, source=patches)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is reset through /proc")
def test_the_memory_estimate_is_not_below() -> None:
    real, estimate = peak_and_estimate(_MADE)
    assert real <= estimate <= 3.0 * real + 2 * SLACK


@pytest.mark.skipif(not torch.cuda.is_available(), reason="no GPU here")
def test_devices_agree() -> None:
    patches = torch.randn(9, NANO.patch_points, 3)
    network = made()
    with torch.no_grad():
        expected = network.describe(patches)
        assert torch.allclose(network.to("cuda").describe(patches.to("cuda")).cpu(), expected, atol=1e-3)
