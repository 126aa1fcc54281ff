# SPDX-License-Identifier: MIT
"""RoITr as a matcher."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

import hybridreg as hr
from hybridreg import registry, testing
from hybridreg.learned.roitr.config import named_config
from hybridreg.learned.roitr.network import RoitrNetwork
from hybridreg.matches import Overlap
from hybridreg.pair import Pair

STAGE = hr.Roitr(untrained=True)
SHIFT = np.array([8.0, -4.0, 4.0])


@pytest.fixture(scope="module")
def shifted() -> Pair:
    points = testing.sample_pair(n_points=1500)[0].source.points
    return Pair.of(points, points + SHIFT, id="shifted")


def trained(folder: Path, **fields: Any) -> str:
    """A folder of weights that look trained."""
    torch.manual_seed(1)
    network = RoitrNetwork(dataclasses.replace(named_config("nano"), **fields))
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.01 * torch.randn_like(parameter)
    network.save_pretrained(folder)
    return str(folder)


@pytest.mark.parametrize("check", testing.checks(), ids=lambda check: check.__name__)
def test_the_suite(check: testing.stages.Check) -> None:
    check(STAGE, "match")


def test_it_is_registered() -> None:
    assert registry.name_of(STAGE) == "match.roitr"
    assert "roitr" in registry.slot_fits("match", gives="group")


def test_a_shifted_cloud_is_found_untrained(shifted: Pair) -> None:
    pipeline = hr.Pipeline(voxel=0.5, match=STAGE, estimate="lgr", refine="none")
    result = pipeline.run(shifted)
    assert np.allclose(result.transformation[:3, 3], SHIFT, atol=0.05)
    assert "Roitr ran with random weights (untrained=True)" in result.notes


def test_random_weights_must_be_asked_for(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"Roitr: .*these weights are random.*untrained=True"):
        hr.Roitr(size="nano")
    STAGE.save_pretrained(tmp_path)
    with pytest.raises(ValueError, match="these weights are random: backbone, transformer of"):
        hr.Roitr.from_pretrained(tmp_path)
    assert hr.Roitr.from_pretrained(trained(tmp_path / "more")).weights == str(tmp_path / "more")


def test_weights_of_another_network_are_refused(tmp_path: Path) -> None:
    hr.GeoTransformer(untrained=True).save_pretrained(tmp_path)
    with pytest.raises(ValueError, match="of the network 'cross3dreg', not of 'roitr'"):
        hr.Roitr.from_pretrained(tmp_path)
    with pytest.raises(FileNotFoundError, match=r"no checkpoint .*gone.pth"):
        hr.Roitr.load_official(tmp_path / "gone.pth")
    with pytest.raises(ValueError, match="device='nowhere'"):
        hr.Roitr(untrained=True, device="nowhere").network()
    with pytest.raises(ValueError, match="min_overlap"):
        hr.Roitr(untrained=True, min_overlap=2.0)


def test_a_mask_leaves_superpoints_out(shifted: Pair) -> None:
    scene = hr.VoxelGrid(voxel=0.5)(shifted)
    right = (scene.source.points[:, 0] > 0).astype(float)
    everywhere = np.ones(len(scene.target))
    masked = STAGE(scene, Overlap(right, everywhere))
    assert len(masked)
    assert masked.source[:, 0].min() > -4.0  # a superpoint's patch reaches over the edge
    nothing = STAGE(scene, Overlap(np.zeros_like(right), everywhere))
    assert len(nothing) == len(STAGE(scene, Overlap(np.ones_like(right), everywhere)))


def test_another_voxel_and_too_many_points_are_told(shifted: Pair, tmp_path: Path) -> None:
    stage = hr.Roitr(weights=trained(tmp_path, max_points=500))
    scene = hr.VoxelGrid(voxel=0.3)(shifted)
    found = stage(scene, Overlap.full(len(scene.source), len(scene.target)))
    assert found.spacing == 0.5
    assert any("voxel of 0.5 m" in note for note in scene.notes)
    assert any("RoITr used 500 of" in note and "max_points" in note for note in scene.notes)


def test_too_large_a_pair_is_refused(shifted: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = hr.VoxelGrid(voxel=0.5)(shifted)
    stage = hr.Roitr(weights=trained(tmp_path))
    monkeypatch.setattr("hybridreg.learned.memory_estimate.available_bytes", lambda device: 10**6)
    counts = f"{len(scene.target)} target and {len(scene.source)} source points"
    with pytest.raises(ValueError, match=rf"{counts}.*voxel larger than 0.5 m, or crop"):
        stage(scene, Overlap.full(len(scene.source), len(scene.target)))
