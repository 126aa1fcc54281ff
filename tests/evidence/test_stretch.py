# SPDX-License-Identifier: MIT
"""A source that is stretched, sheared, or has all ranges off is told, and no pose is "ok" that is wrong so."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from made_places import Made
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.loaders.folder import load_pair
from hybridreg.evidence import views
from hybridreg.evidence.deformation.heights import heights
from hybridreg.evidence.deformation.stretch import Stretch
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.pair import Pair

Array = NDArray[np.float64]

STRETCHED, NARROWED, SHEARED = np.diag([1.05, 1.0, 1.0]), np.diag([1.0, 0.94, 1.0]), np.eye(3)
SHEARED[0, 1] = 0.05


def evidence(made: Made, strain: Array) -> PoseEvidence:
    """Of the true pose of a source that is strained about its sensor."""
    pair = made.scene.pair
    scene = VoxelGrid()(Pair.of(pair.source.points @ strain.T, pair.target.points))
    return PoseEvidence(views.of(scene), made.truth)


@pytest.mark.parametrize(
    "strain, factor",
    [(STRETCHED, 1 / 1.05), (NARROWED, 1 / 0.94), (SHEARED, 1.025)],
    ids=["5", "-6", "shear"],
)
def test_the_stretch_is_found_with_its_direction(crossing: Made, strain: Array, factor: float) -> None:
    found = evidence(crossing, strain).stretch
    assert found is not None
    undone = np.linalg.inv(strain) @ crossing.truth[:3, :3].T @ found.direction
    assert abs(abs(np.log(found.factor)) - abs(np.log(factor))) < 0.01
    if strain is not SHEARED:
        assert np.linalg.norm(undone) == pytest.approx(factor, abs=0.01)


def test_what_fits_as_it_is_is_not_stretched(crossing: Made, fan: Made, corridor: Made) -> None:
    for made in (crossing, fan, corridor):
        assert evidence(made, np.eye(3)).stretch is None


def test_small_strains_of_heights_are_left_out_and_a_size_is_told_as_one(crossing: Made) -> None:
    assert evidence(crossing, np.diag([1.0, 1.0, 1.06])).stretch is None
    sized = evidence(crossing, 1.04 * np.eye(3)).stretch
    assert sized is not None
    assert sized.is_size
    assert not Stretch(1.05, np.eye(3)[0], 1.01).is_size
    assert not Stretch(1.025, np.eye(3)[0], 0.975).is_size


@pytest.mark.parametrize("strain", [STRETCHED, SHEARED], ids=["5", "shear"])
def test_no_pose_of_a_strained_source_is_ok(crossing: Made, strain: Array) -> None:
    pair = crossing.scene.pair
    result = hr.register(pair.source.points @ strain.T, pair.target.points)
    assert result.verdict != "ok"
    if result.verdict == "doubtful":
        assert "the source fits better when it is stretched by" in " ".join(result.reasons)


@pytest.mark.parametrize("name", ["kitti-odo-5-to-0", "pandaset-002-gt-to-p64"])
def test_real_pairs(real_data: Path, name: str) -> None:
    if not (real_data / name).is_dir():
        pytest.skip(f"no pair {name}")
    source, target = (np.load(real_data / name / f"{side}.npz")["xyz"] for side in ("source", "target"))
    assert hr.register(source, target).verdict == "ok"
    strained = hr.register(source * [1.06, 1.0, 1.0], target)
    assert strained.verdict == "doubtful"
    assert len(strained.entries) == 1


def real_evidence(folder: Path, deform: Callable[[Array], Array]) -> PoseEvidence:
    """Of the true pose of a real pair whose source is deformed."""
    made = load_pair(folder)
    scene = VoxelGrid()(Pair.of(deform(made.pair.source.points), made.pair.target.points))
    return PoseEvidence(views.of(scene), made.T_target_source)


@pytest.mark.parametrize("factor", [0.3048, 0.5, 1.5, 1 / 0.3048])
@pytest.mark.parametrize("name", ["kitti-odo-5-to-0", "sustech-970-to-965"])
def test_heights_in_another_unit_are_told(real_data: Path, name: str, factor: float) -> None:
    # Over the ground, which a registration lays on the ground.
    low = real_evidence(real_data / name, lambda p: p).views.source.ground
    assert low is not None
    found = real_evidence(
        real_data / name, lambda p: p + np.outer((factor - 1.0) * low.above(p), low.up)
    ).stretch
    assert found is not None
    assert abs(found.direction[2]) > 0.99
    assert abs(np.log(found.factor * factor)) < 0.1


@pytest.mark.parametrize("factor", [0.9, 1.1])
@pytest.mark.parametrize("name", ["kitti-odo-5-to-0", "hdl32-small-gicp", "balm-os-50-to-20"])
def test_heights_a_tenth_off_are_told(real_data: Path, name: str, factor: float) -> None:
    made = load_pair(real_data / name)
    result = hr.register(made.pair.source.points * [1.0, 1.0, factor], made.pair.target.points)
    assert result.verdict == "doubtful"
    assert any("fits better when it is stretched by" in reason for reason in result.reasons)


@pytest.mark.parametrize("factor", [0.7, 0.9, 1.2, 1.4])
def test_heights_of_a_hall_are_told_by_its_level_surfaces(real_data: Path, factor: float) -> None:
    # Walls are most of what there is, and lie where they lay; 0.7 was "ok", and half a metre off.
    made = load_pair(real_data / "balm-os-50-to-20")
    result = hr.register(made.pair.source.points * [1.0, 1.0, factor], made.pair.target.points)
    assert result.verdict != "ok"
    found = PoseEvidence(views.of(VoxelGrid()(made.pair)), made.T_target_source)
    assert heights(found.views, found.T) is None
