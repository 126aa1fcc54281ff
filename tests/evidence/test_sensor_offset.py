# SPDX-License-Identifier: MIT
"""Ranges or elevations that are all off by as much are told, with the amount, and no pose that is wrong so is "ok"."""

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
from hybridreg.evidence.deformation.sensor_offset import SensorOffset, sensor_offset
from hybridreg.pair import Pair

Array = NDArray[np.float64]


def measured(points: Array, metres: float = 0.0, degrees: float = 0.0) -> Array:
    """What a sensor at the origin measures that adds so much to its ranges and its elevations."""
    level = np.hypot(points[:, 0], points[:, 1])
    azimuth, elevation = np.arctan2(points[:, 1], points[:, 0]), np.arctan2(points[:, 2], level)
    ranges, elevation = np.hypot(level, points[:, 2]) + metres, elevation + np.radians(degrees)
    level = ranges * np.cos(elevation)
    return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), ranges * np.sin(elevation)])


def offset(source: Array, target: Array, truth: Array) -> SensorOffset:
    found = sensor_offset(views.of(VoxelGrid()(Pair.of(source, target))), truth)
    assert found is not None
    return found


@pytest.mark.parametrize("metres, degrees", [(0.3, 0.0), (-0.25, 0.0), (0.0, 3.0), (0.0, -2.0), (0.3, 3.0)])
def test_the_offset_is_measured(crossing: Made, metres: float, degrees: float) -> None:
    source, target = crossing.scene.pair.source.points, crossing.scene.pair.target.points
    found = offset(measured(source, metres, degrees), target, crossing.truth)
    assert found.told
    # Near by, the other sensor may as well be off the other way.
    assert found.metres == pytest.approx(-metres if found.side == "source" else metres, abs=0.06)
    assert abs(found.degrees) == pytest.approx(abs(degrees), abs=0.4)
    assert (found.in_range, found.in_elevation) == (metres != 0.0, degrees != 0.0)


def test_it_may_be_the_targets(crossing: Made) -> None:
    source, target = crossing.scene.pair.source.points, crossing.scene.pair.target.points
    found = offset(source, measured(target, degrees=3.0), crossing.truth)
    assert found.told
    assert abs(found.degrees) == pytest.approx(3.0, abs=0.4)


def test_none_is_told_of_what_was_measured_well(crossing: Made, fan: Made, corridor: Made) -> None:
    for made in (crossing, fan, corridor):
        found = offset(made.scene.pair.source.points, made.scene.pair.target.points, made.truth)
        assert not found.told
        assert not found.beyond


@pytest.mark.parametrize("metres", [1.0, 0.5, -0.5, 0.3])
@pytest.mark.parametrize("name", ["kitti-city-20-to-0", "opencalib-hesai1-qt202-to-p64"])
def test_ranges_of_real_sensors_are_measured(real_data: Path, name: str, metres: float) -> None:
    made = load_pair(real_data / name)
    found = offset(measured(made.pair.source.points, metres), made.pair.target.points, made.T_target_source)
    assert found.told
    assert abs(found.metres) == pytest.approx(abs(metres), abs=0.06)


def test_a_pose_that_ranges_move_beyond_the_tolerance_is_not_ok(real_data: Path) -> None:
    made = load_pair(real_data / "kitti-city-20-to-0")
    result = hr.register(measured(made.pair.source.points, metres=1.0), made.pair.target.points)
    assert result.verdict == "doubtful"
    assert len(result.entries) == 1, "no pose of such a source is right: the search ends"
    assert any("ranges are 1.0" in reason for reason in result.reasons)


@pytest.mark.parametrize("side", ["source", "target"])
@pytest.mark.parametrize("name", ["av2-7fab-up-to-down", "sustech-965-to-950", "sustech-970-to-965"])
def test_no_pose_that_elevations_take_along_is_ok(real_data: Path, name: str, side: str) -> None:
    made = load_pair(real_data / name)
    clouds = {"source": made.pair.source.points, "target": made.pair.target.points}
    clouds[side] = measured(clouds[side], degrees=4.0)
    result = hr.register(**clouds)
    assert result.verdict != "ok"
    assert "elevations are" in " ".join(result.reasons)


def test_heights_are_in_the_same_unit_where_the_elevations_are_off(real_data: Path) -> None:
    made = load_pair(real_data / "kitti-city-20-to-0")
    result = hr.register(measured(made.pair.source.points, degrees=2.0), made.pair.target.points)
    told = " ".join(result.reasons)
    assert "all its elevations are" in told
    assert "stretched" not in told


def test_a_map_has_no_sensor(crossing: Made) -> None:
    source, target = crossing.scene.pair.source.points, crossing.scene.pair.target.points
    pair = Pair.of(source, target, source_viewpoint="none", target_viewpoint="none")
    assert sensor_offset(views.of(VoxelGrid()(pair)), crossing.truth) is None
