# SPDX-License-Identifier: MIT
"""A sensor that turned or moved while it measured is told, by how much, and no pose is "ok" that is wrong so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_places import Made
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.loaders.folder import load_pair
from hybridreg.evidence import views
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.pair import Pair

Array = NDArray[np.float64]


def swept(points: Array, degrees: float, metres: float, start: float = 1.0) -> Array:
    """What a sensor measures that turns about z and moves along x during one sweep, which begins at `start` radians."""
    phase = ((np.arctan2(points[:, 1], points[:, 0]) - start) / (2.0 * np.pi)) % 1.0 - 0.5
    turns = se3.rotation_about(np.radians(degrees) * phase[:, None] * np.array([0.0, 0.0, 1.0]))
    return np.einsum("nji,nj->ni", turns, points - metres * phase[:, None] * np.array([1.0, 0.0, 0.0]))


def evidence(pair: Pair, truth: Array) -> PoseEvidence:
    return PoseEvidence(views.of(VoxelGrid()(pair)), truth)


@pytest.mark.parametrize("start", [1.0, 4.3])
@pytest.mark.parametrize("degrees, metres", [(8.0, 0.0), (0.0, 1.5), (-6.0, 1.0)])
def test_the_turn_and_the_way_are_measured(
    crossing: Made, degrees: float, metres: float, start: float
) -> None:
    source, target = crossing.scene.pair.source.points, crossing.scene.pair.target.points
    found = evidence(Pair.of(swept(source, degrees, metres, start), target), crossing.truth).motion_distortion
    assert found is not None
    assert found.degrees == pytest.approx(abs(degrees), abs=1.0)
    assert found.metres == pytest.approx(metres, abs=0.5)
    assert found.beyond


def test_either_cloud_may_have_been_taken_in_motion(crossing: Made) -> None:
    source, target = crossing.scene.pair.source.points, crossing.scene.pair.target.points
    found = evidence(Pair.of(source, swept(target, 8.0, 0.0)), crossing.truth).motion_distortion
    assert found is not None
    assert found.degrees == pytest.approx(8.0, abs=1.5)


def test_what_stood_still_has_no_motion(crossing: Made, fan: Made, corridor: Made) -> None:
    for made in (crossing, fan, corridor):
        assert evidence(made.scene.pair, made.truth).motion_distortion is None


def test_a_map_has_no_sweep(crossing: Made) -> None:
    source, target = crossing.scene.pair.source.points, crossing.scene.pair.target.points
    pair = Pair.of(swept(source, 8.0, 0.0), target, source_viewpoint="none", target_viewpoint="none")
    assert evidence(pair, crossing.truth).motion_distortion is None


def test_a_slow_turn_is_told_and_leaves_no_doubt(real_data: Path) -> None:
    made = load_pair(real_data / "kitti-odo-5-to-0")
    result = hr.register(swept(made.pair.source.points, 3.0, 0.0), made.pair.target.points)
    assert result.verdict == "ok"
    assert any("its sensor turned by 3." in reason and "deskew" in reason for reason in result.reasons)


@pytest.mark.parametrize("side", ["source", "target"])
@pytest.mark.parametrize(
    "name, degrees, metres",
    [("kitti-odo-5-to-0", 10.0, 1.0), ("sustech-975-to-965", 5.0, 0.0), ("kitti-city-20-to-0", 9.0, 0.0)],
)
def test_no_pose_of_a_fast_sensor_is_ok(
    real_data: Path, name: str, degrees: float, metres: float, side: str
) -> None:
    pair = load_pair(real_data / name).pair
    source, target = (
        swept(cloud.points, degrees, metres) if which == side else cloud.points
        for which, cloud in (("source", pair.source), ("target", pair.target))
    )
    result = hr.register(source, target)
    assert result.verdict != "ok"
    assert len(result.entries) == 1, "no pose of such a cloud is right: the search ends"
    assert any("within one sweep, so that no rigid pose is right" in reason for reason in result.reasons)
