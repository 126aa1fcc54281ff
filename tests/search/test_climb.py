# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.cloud import PointCloud
from hybridreg.data.hard import box_world
from hybridreg.evidence import log_odds, views
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.scene import Scene
from hybridreg.search.pattern_search import climb


@pytest.fixture(scope="module")
def yard() -> tuple[Scene, np.ndarray]:
    rng = np.random.default_rng(4)
    world = box_world.yard(rng)
    at = [box_world.sensor_pose(0, 0, 1.8, 20), box_world.sensor_pose(4, 1, 1.8, 130)]
    source, target = (
        PointCloud.of(box_world.scan(world, sensor, pose, rng))
        for sensor, pose in zip(("rings32", "rings64"), at, strict=True)
    )
    return VoxelGrid()(Pair(source=source, target=target)), se3.inverse(at[1]) @ at[0]


def beside(T: np.ndarray, metres: tuple[float, float], turn_deg: float) -> np.ndarray:
    return se3.from_rt(np.eye(3), np.array([*metres, 0.0])) @ T @ se3.yaw(turn_deg)


@pytest.mark.parametrize(("metres", "turn_deg"), [((1.0, 0.3), 0.0), ((-0.4, 0.9), 2.0), ((0.6, -0.6), -2.0)])
def test_a_pose_beside_the_right_one_climbs_to_it(
    yard: tuple[Scene, np.ndarray], metres: tuple[float, float], turn_deg: float
) -> None:
    scene, truth = yard
    start = beside(truth, metres, turn_deg)
    step = climb(views.of(scene), start).T @ se3.inverse(truth)
    assert se3.angle_deg(step[:3, :3]) < 1.0
    assert np.linalg.norm(step[:3, 3]) < 0.35 < np.linalg.norm((start @ se3.inverse(truth))[:3, 3])


def test_support_never_falls_and_the_ground_stays_where_it_is(yard: tuple[Scene, np.ndarray]) -> None:
    scene, truth = yard
    start = beside(truth, (2.0, -1.0), 15.0)
    end = climb(views.of(scene), start).T
    before, after = (log_odds.of(views.of(scene), T, stride=3) for T in (start, end))
    assert after >= before
    step = end @ se3.inverse(start)
    assert abs(step[2, 2]) == pytest.approx(1.0, abs=1e-3)
