# SPDX-License-Identifier: MIT
"""SphereNet as a matcher: its cost told, its caps, its options."""

from __future__ import annotations

import dataclasses
import warnings
from pathlib import Path

import numpy as np
import pytest
import torch

import hybridreg as hr
from hybridreg import registry, testing
from hybridreg.learned.vrhcf import stage as stage_module
from hybridreg.learned.vrhcf.config import named_config
from hybridreg.learned.vrhcf.network import SphereNet
from hybridreg.matches import Overlap
from hybridreg.pair import Pair
from hybridreg.scene import Scene

STAGE = hr.Vrhcf(untrained=True, max_keypoints=60)
SHIFT = np.array([8.0, -4.0, 4.0])


@pytest.fixture(scope="module")
def shifted() -> Pair:
    points = testing.sample_pair(n_points=1000)[0].source.points
    return Pair.of(points, points + SHIFT, id="shifted")


def full(scene: Scene) -> Overlap:
    return Overlap.full(len(scene.source), len(scene.target))


@pytest.mark.parametrize("check", testing.checks(), ids=lambda check: check.__name__)
def test_the_suite(check: testing.stages.Check) -> None:
    check(STAGE, "match")


def test_it_is_registered() -> None:
    assert registry.name_of(STAGE) == "match.vrhcf"


def test_a_shifted_cloud_is_found_untrained(shifted: Pair) -> None:
    pipeline = hr.Pipeline(
        voxel=0.5, match=hr.Vrhcf(untrained=True, max_keypoints=10_000), estimate="hcf", refine="none"
    )
    result = pipeline.run(shifted)
    assert np.allclose(result.transformation[:3, 3], SHIFT, atol=0.3)
    assert "Vrhcf ran with random weights (untrained=True)" in result.notes


def test_what_a_cpu_cannot_pay_for_is_told_and_capped(shifted: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage_module, "_CPU_BUDGET", 5e8)
    scene = hr.VoxelGrid(voxel=0.5)(shifted)
    with pytest.warns(
        UserWarning, match=r"VRHCF describes 70 of \d+ source and 70 of \d+ target keypoints.*max_keypoints"
    ):
        found = hr.Vrhcf(untrained=True)(scene, full(scene))
    assert len(found) == 70
    assert any("0.0035 G multiply-adds each" in note for note in scene.notes)
    insisting = hr.Vrhcf(untrained=True, max_keypoints=10_000)
    with pytest.warns(UserWarning, match="about to describe"):
        assert len(insisting(scene, full(scene))) == len(scene.source)


def test_a_cap_that_was_asked_for_is_no_warning(shifted: Pair) -> None:
    scene = hr.VoxelGrid(voxel=0.5)(shifted)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = STAGE(scene, full(scene))
    assert len(found) == 60
    assert found.spacing == 0.5
    assert any("describes 60 of" in note for note in scene.notes)


def test_the_published_size_affords_some_hundreds() -> None:
    from hybridreg.learned.vrhcf.cost import multiply_adds

    each = multiply_adds(named_config("vrhcf-3dmatch"))
    assert 200 < stage_module._CPU_BUDGET / each / 2 < 1000


def test_mutual_matches_are_fewer_and_a_mask_leaves_keypoints_out(shifted: Pair) -> None:
    scene = hr.VoxelGrid(voxel=0.5)(shifted)
    every, mutual = (dataclasses.replace(STAGE, mutual=m)(scene, full(scene)) for m in (False, True))
    assert 0 < len(mutual) < len(every)
    right = (scene.source.points[:, 0] > 0).astype(float)
    masked = STAGE(scene, Overlap(right, np.ones(len(scene.target))))
    assert masked.source[:, 0].min() > 0.0


def test_released_and_right_matching_differ(shifted: Pair) -> None:
    scene = hr.VoxelGrid(voxel=0.5)(shifted)
    targets = [
        dataclasses.replace(STAGE, matching=m)(scene, full(scene)).target for m in ("channels", "unit")
    ]
    assert not np.array_equal(*targets)


def test_wrong_fields_and_weights_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"Vrhcf: .*these weights are random.*untrained=True"):
        hr.Vrhcf(size="nano")
    for fields, message in (
        ({"max_keypoints": 2}, "max_keypoints=2"),
        ({"matching": "rows"}, "matching: expected one of 'channels', 'unit', got 'rows'"),
        ({"min_overlap": -1.0}, "min_overlap"),
    ):
        with pytest.raises(ValueError, match=message):
            hr.Vrhcf(untrained=True, **fields)  # type: ignore[arg-type]
    STAGE.save_pretrained(tmp_path)
    with pytest.raises(ValueError, match="these weights are random: layers of"):
        hr.Vrhcf.from_pretrained(tmp_path)
    network = SphereNet.named("nano").train()
    network.describe(torch.randn(4, network.config.patch_points, 3))
    network.save_pretrained(tmp_path / "trained")
    assert hr.Vrhcf.from_pretrained(tmp_path / "trained").network().config == named_config("nano")
    with pytest.raises(ValueError, match="of the network 'vrhcf', not of 'roitr'"):
        hr.Roitr.from_pretrained(tmp_path / "trained")


def test_too_little_memory_is_told(shifted: Pair, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hybridreg.learned.memory_estimate.available_bytes", lambda device="cpu": 10**6)
    scene = hr.VoxelGrid(voxel=0.5)(shifted)
    with pytest.raises(ValueError, match=r"60 target and 60 source points.*max_keypoints"):
        STAGE(scene, full(scene))
