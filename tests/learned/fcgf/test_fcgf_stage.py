# SPDX-License-Identifier: MIT
"""FCGF as a matcher."""

from __future__ import annotations

import dataclasses
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from measured import peak_and_estimate

import hybridreg as hr
from hybridreg import testing
from hybridreg.learned import memory_estimate
from hybridreg.learned.fcgf.config import named_config
from hybridreg.learned.fcgf.network import FcgfNetwork
from hybridreg.learned.fcgf.official_names import official_name
from hybridreg.matches import Overlap
from hybridreg.pair import Pair
from hybridreg.scene import Scene

# A whole number of the nano network's coarsest voxels (2 m): both clouds fall alike into every grid.
SHIFT = np.array([8.0, -4.0, 4.0])


@pytest.fixture
def trained(tmp_path: Path) -> str:
    """A folder of weights that have been moved as a training step would."""
    torch.manual_seed(5)
    network = FcgfNetwork(named_config("nano"))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.01 * torch.randn_like(parameter)
    network.save_pretrained(tmp_path / "weights")
    return str(tmp_path / "weights")


@pytest.fixture(scope="module")
def scene() -> Scene:
    """A cloud and its shifted copy."""
    points = testing.sample_pair(n_points=1500)[0].source.points
    return hr.VoxelGrid(voxel=0.5)(Pair.of(points, points + SHIFT, id="shifted"))


def full(scene: Scene) -> Overlap:
    return Overlap.full(len(scene.source), len(scene.target))


@pytest.mark.parametrize("check", testing.checks(), ids=lambda check: check.__name__)
@pytest.mark.parametrize("size", ["nano", "small"])
def test_the_suite(check: testing.stages.Check, size: str) -> None:
    check(hr.Fcgf(untrained=True, size=size), "match")


def test_a_shifted_copy_is_matched(scene: Scene, trained: str) -> None:
    found = hr.Fcgf(weights=trained, mutual=True)(scene, full(scene))
    errors = np.linalg.norm(found.source + SHIFT - found.target, axis=1)
    assert len(found) > 300
    assert np.mean(errors < 0.5) > 0.9
    assert found.spacing == 0.5
    assert (found.weight <= 1.0 + 1e-6).all()


def test_all_points_are_matched_unless_mutual(trained: str) -> None:
    scene = hr.VoxelGrid(voxel=0.5)(testing.sample_pair(n_points=1500)[0])
    every, mutual = (hr.Fcgf(weights=trained, mutual=m)(scene, full(scene)) for m in (False, True))
    points = scene.pair.source.points
    voxels = len(np.unique(np.floor(points.astype(np.float32) / np.float32(0.5)), axis=0))
    assert len(every) == voxels
    assert len(mutual) < voxels


def test_a_mask_leaves_points_out_unless_too_few_remain(scene: Scene, trained: str) -> None:
    stage = hr.Fcgf(weights=trained)
    right = (scene.source.points[:, 0] > 0).astype(float)
    everywhere = np.ones(len(scene.target))
    assert (stage(scene, Overlap(right, everywhere)).source[:, 0] > -0.7).all()
    assert len(stage(scene, Overlap(np.zeros_like(right), everywhere))) == len(stage(scene, full(scene)))


def test_random_weights_are_refused_unless_asked_for(scene: Scene, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"Fcgf: without weights.*random.*untrained=True"):
        hr.Fcgf(size="nano")
    FcgfNetwork(named_config("nano")).save_pretrained(tmp_path)
    with pytest.raises(ValueError, match="these weights are random: decoder, encoder of"):
        hr.Fcgf.from_pretrained(tmp_path)
    fresh = dataclasses.replace(scene, notes=[])
    hr.Fcgf(weights=str(tmp_path), untrained=True)(fresh, full(fresh))
    assert "Fcgf ran with random weights (untrained=True)" in fresh.notes


def test_a_published_checkpoint_is_a_stage(trained: str, scene: Scene, tmp_path: Path) -> None:
    network = FcgfNetwork.from_pretrained(trained)
    state = {official_name(name): value for name, value in network.state_dict().items()}
    torch.save({"state_dict": state}, tmp_path / "fcgf.pth")
    stage = hr.Fcgf.load_official(tmp_path / "fcgf.pth", normalize=True, voxel=0.5)
    found, want = stage(scene, full(scene)), hr.Fcgf(weights=trained)(scene, full(scene))
    assert np.allclose(found.target, want.target)
    with pytest.raises(ValueError, match="say normalize=True or normalize=False"):
        hr.Fcgf(weights=str(tmp_path / "fcgf.pth")).network()
    with pytest.raises(ValueError, match=r"normalize=True: the weights .* have their own configuration"):
        hr.Fcgf(weights=trained, normalize=True).network()
    with pytest.raises(ValueError, match=r"size='small': the weights .* have their own"):
        hr.Fcgf(weights=trained, size="small").network()


def test_features_that_are_no_numbers_match_nothing(scene: Scene, tmp_path: Path) -> None:
    network = FcgfNetwork(dataclasses.replace(named_config("nano"), normalize_eps=0.0))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.mul_(1e-30)  # the product of two is nought; weights of zeros only are refused
    network.save_pretrained(tmp_path)
    assert len(hr.Fcgf(weights=str(tmp_path))(scene, full(scene))) == 0


def test_another_spacing_is_told(scene: Scene, trained: str) -> None:
    coarse = hr.VoxelGrid(voxel=2.0)(scene.pair)
    hr.Fcgf(weights=trained)(coarse, full(coarse))
    assert any("voxel of 0.5 m" in note for note in coarse.notes)


def test_what_does_not_fit_is_refused(scene: Scene, trained: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(memory_estimate, "available_bytes", lambda device: 10**6)
    with pytest.raises(ValueError, match=r"target and \d+ source points.*larger than 0.5 m, or crop"):
        hr.Fcgf(weights=trained)(scene, full(scene))


def test_it_travels_through_a_file(trained: str, tmp_path: Path) -> None:
    pipe = hr.Pipeline(
        voxel=0.5, match=hr.Fcgf(weights=trained, mutual=True), estimate="ransac", refine="none"
    )
    pipe.save(tmp_path / "pipe.toml")
    assert hr.Pipeline.load(tmp_path / "pipe.toml").to_spec() == pipe.to_spec()


_MADE = """
from hybridreg.learned.fcgf.batch import make_batch
from hybridreg.learned.fcgf.network import FcgfNetwork
network = FcgfNetwork.named("small")
clouds = [rng.uniform(0, 60, (20000, 3)) * [1, 1, 0.02] for _ in range(2)]
batch = make_batch(*clouds, network.config)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is reset through /proc")
def test_the_estimate_of_memory_is_near_and_not_below() -> None:
    real, estimate = peak_and_estimate(_MADE)
    assert real <= estimate
    assert estimate - memory_estimate.SLACK <= 1.4 * real
