# SPDX-License-Identifier: MIT
from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from hybridreg.classical.visibility import Visibility
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.cloud import PointCloud
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.scene import Scene

Array = NDArray[np.float64]
HEIGHT = 2.0


def plain(
    reach: float, elevation_deg: tuple[float, float], azimuth_deg: float = 360.0, step: float = 0.5
) -> Array:
    """Returns of a sensor 2 m over open ground before a round wall at `reach`, as high as it can look."""
    low, high = elevation_deg
    e, a = np.radians(
        np.stack(
            np.meshgrid(np.arange(low, high + 1e-9, step), np.arange(-azimuth_deg / 2, azimuth_deg / 2, 1.0))
        )
    ).reshape(2, -1)
    flat = np.where(e < -1e-6, np.minimum(reach, -HEIGHT / np.tan(np.minimum(e, -1e-6))), reach)
    return np.column_stack([flat * np.cos(a), flat * np.sin(a), flat * np.tan(e)])


def scene_of(source: Array, target: Array, voxel: float = 0.5) -> Scene:
    return VoxelGrid(voxel=voxel)(Pair(source=PointCloud.of(source), target=PointCloud.of(target)))


def seen_from_origin(source: Array, target: Array, voxel: float) -> Scene:
    """Clouds that no sensor could have seen from where it is said to have stood."""
    clouds = (PointCloud.of(points, viewpoint=np.zeros(3)) for points in (source, target))
    return VoxelGrid(voxel=voxel)(Pair(**dict(zip(("source", "target"), clouds, strict=True))))


CIRCLE = plain(40.0, (-25.0, 15.0))
FAN = plain(15.0, (-45.0, 5.0), azimuth_deg=70.0)


def test_points_beyond_the_others_range_are_weighted_down() -> None:
    scene = scene_of(FAN, CIRCLE)
    overlap = Visibility(baseline=4.0)(scene)
    distance = np.linalg.norm(scene.target.points[:, :2], axis=1)
    low = scene.target.points[:, 2] < 0.0
    assert overlap.target[(distance > 20.0) & low].max() == 0.0
    assert overlap.target[(distance > 6.0) & (distance < 10.0) & low].min() > 0.9
    between = overlap.target[(distance > 14.0) & (distance < 16.0) & low]
    assert 0.2 < between.mean() < 0.8


def test_points_over_the_others_field_of_view_are_weighted_down() -> None:
    scene = scene_of(plain(40.0, (-25.0, 5.0)), CIRCLE)
    overlap = Visibility(baseline=2.0)(scene)
    height = scene.target.points[:, 2]
    # On the wall 40 m away the source looks no higher than 40 tan(5 deg) = 3.5 m over its eye.
    assert overlap.target[height > 5.0].max() == 0.0
    assert overlap.target[(height > 0.0) & (height < 2.5)].mean() > 0.4
    assert overlap.source[scene.source.points[:, 2] > 0.0].mean() > 0.4


def test_a_narrow_fan_thins_no_direction() -> None:
    scene = scene_of(FAN, CIRCLE)
    overlap = Visibility(baseline=4.0)(scene)
    near = np.linalg.norm(scene.target.points[:, :2], axis=1) < 9.0
    near &= np.linalg.norm(scene.target.points[:, :2], axis=1) > 6.0
    azimuth = np.degrees(np.arctan2(scene.target.points[near, 1], scene.target.points[near, 0]))
    assert (
        overlap.target[near][np.abs(azimuth) < 30].mean()
        == overlap.target[near][np.abs(azimuth) > 90].mean()
        == 1.0
    )


@pytest.mark.parametrize("tilt_deg", [180.0, 30.0, -60.0])
def test_how_the_sensors_hang_does_not_matter(tilt_deg: float) -> None:
    R = se3.rotation_about(np.array([np.radians(tilt_deg), 0.1, 0.2]))
    upright = scene_of(FAN, CIRCLE)
    tilted = replace(
        upright,
        pair=Pair(source=upright.pair.source, target=PointCloud.of(CIRCLE @ R.T)),
        target=replace(upright.target, points=upright.target.points @ R.T),
        _shared={},
    )
    there, here = Visibility(baseline=4.0)(upright), Visibility(baseline=4.0)(tilted)
    # The rays' outermost percent is found among other cells: a place or two of the 24 may change.
    assert np.mean(np.abs(here.target - there.target)) < 0.03
    assert np.mean(np.abs(here.source - there.source)) < 0.03


def test_ground_is_found_under_a_sensor_on_its_head() -> None:
    R = se3.rotation_about(np.array([np.pi, 0.0, 0.0]))
    found = scene_of(FAN, CIRCLE @ R.T).target.ground
    assert found is not None
    assert found.up == pytest.approx([0.0, 0.0, -1.0], abs=0.02)
    assert found.above(np.zeros((1, 3)))[0] == pytest.approx(HEIGHT, abs=0.1)


def lane() -> Array:
    """A strip of ground between a high wall and a low one, the sensor near the high one: that holds most points."""
    rng = np.random.default_rng(0)
    along = rng.uniform(-15.0, 15.0, 12_000)
    ground_, high, low = np.split(along, [500, 9_000])
    return np.concatenate(
        [
            np.column_stack([ground_, rng.uniform(-1.0, 4.0, len(ground_)), np.full(len(ground_), -HEIGHT)]),
            np.column_stack([high, np.full(len(high), -1.0), rng.uniform(-HEIGHT, 6.0, len(high))]),
            np.column_stack([low, np.full(len(low), 4.0), rng.uniform(-HEIGHT, 1.0, len(low))]),
        ]
    )


def test_a_wall_is_not_taken_for_the_ground_though_it_holds_more_points() -> None:
    found = scene_of(lane(), lane()).source.ground
    assert found is not None
    assert found.up == pytest.approx([0.0, 0.0, 1.0], abs=0.05)


def test_where_no_plane_is_level_a_steep_one_is_the_ground() -> None:
    R = se3.rotation_about(np.array([np.radians(70.0), 0.0, 0.0]))
    found = scene_of(CIRCLE @ R.T, CIRCLE).source.ground
    assert found is not None
    assert found.up == pytest.approx(R[:, 2], abs=0.05)


def test_no_ground_no_vertical_but_still_a_range() -> None:
    directions = np.random.default_rng(0).normal(size=(6000, 3))
    ball = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    both = np.concatenate([30.0 * ball[:3000], 5.0 * ball[3000:]])
    scene = seen_from_origin(10.0 * ball, both, voxel=0.4)
    assert scene.source.ground is None
    overlap = Visibility(baseline=2.0)(scene)
    distance = np.linalg.norm(scene.target.points, axis=1)
    assert overlap.target[distance > 20].max() == 0.0
    assert overlap.target[distance < 6].min() == 1.0


def test_a_cloud_without_a_viewpoint_says_nothing_about_the_other() -> None:
    scene = scene_of(FAN + [500.0, 0.0, 0.0], CIRCLE)
    assert scene.source.viewpoint is None
    overlap = Visibility()(scene)
    assert overlap.target.min() == 1.0
    assert overlap.source.min() == 1.0


@settings(max_examples=10)
@given(st.floats(0.0, 60.0))
def test_probabilities_of_every_point_whatever_the_baseline(baseline: float) -> None:
    scene = scene_of(FAN, CIRCLE, voxel=1.0)
    overlap = Visibility(baseline=baseline)(scene)
    assert overlap.source.shape == (len(scene.source),)
    assert overlap.target.shape == (len(scene.target),)
    for side in (overlap.source, overlap.target):
        assert side.min() >= 0.0
        assert side.max() <= 1.0


@pytest.mark.parametrize("baseline", [-1.0, np.inf, np.nan])
def test_a_baseline_that_is_no_length_is_refused(baseline: float) -> None:
    with pytest.raises(ValueError, match="baseline"):
        Visibility(baseline=baseline)


def test_the_stage_passes_the_public_conformance_suite() -> None:
    from hybridreg.testing import check_stage

    check_stage(Visibility())
