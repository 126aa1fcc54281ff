# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.cloud import PointCloud
from hybridreg.data.hard import box_world
from hybridreg.evidence import log_odds, views
from hybridreg.evidence.surface_distance import closeness
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.scene import Scene
from hybridreg.search.basin_hopping import hop
from hybridreg.search.settle import settle


@pytest.fixture(scope="module")
def street() -> tuple[Scene, np.ndarray]:
    rng = np.random.default_rng(2)
    world = box_world.street(rng)
    at = [box_world.sensor_pose(0, 0, 1.8, 10), box_world.sensor_pose(6, 1, 1.8, -20)]
    source, target = (
        PointCloud.of(box_world.scan(world, sensor, pose, rng))
        for sensor, pose in zip(("rings32", "rings64"), at, strict=True)
    )
    return VoxelGrid()(Pair(source=source, target=target)), se3.inverse(at[1]) @ at[0]


def wrong_by(T: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    step = T @ se3.inverse(truth)
    return se3.angle_deg(step[:3, :3]), float(np.linalg.norm(T[:3, 3] - truth[:3, 3]))


def started(scene: Scene, truth: np.ndarray) -> np.ndarray:
    # So far off along the street that settling comes to rest on the way.
    return settle(views.of(scene), se3.from_rt(np.eye(3), [2.4, 0.6, 0.0]) @ truth)


def test_a_pose_that_rests_beside_the_right_one_leaves_for_it(street: tuple[Scene, np.ndarray]) -> None:
    scene, truth = street
    start = started(scene, truth)
    assert wrong_by(start, truth)[1] > 0.5
    degrees, metres = wrong_by(hop(scene, start[None], np.random.default_rng(0))[0].T, truth)
    assert degrees < 1.5
    assert metres < 0.4


def test_support_and_closeness_are_no_less_than_before(street: tuple[Scene, np.ndarray]) -> None:
    scene, truth = street
    both = views.of(scene)
    start = started(scene, truth)
    (end,) = hop(scene, start[None], np.random.default_rng(1))
    before, after = (
        log_odds.of(both, T, stride=3) + log_odds.beside(0.0, closeness(both.fine, T, 4))
        for T in (start, end.T)
    )
    assert after >= before
    assert end.by_surfaces == log_odds.of(both, end.T)


def test_the_generator_decides_it(street: tuple[Scene, np.ndarray]) -> None:
    scene, truth = street
    one, two = (hop(scene, started(scene, truth)[None], np.random.default_rng(3))[0].T for _ in range(2))
    assert np.array_equal(one, two)
