# SPDX-License-Identifier: MIT
"""A pose that follows one thing which moved is told, and not "ok"; where nothing moved, none is told."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import box_world
from hybridreg.evidence import views
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.pair import Pair

Array = NDArray[np.float64]
MOVED = 0.9


def seen(aside: float, at: tuple[float, float], seed: int) -> Array:
    """A wall with a few pilasters, and a trolley before it, from a narrow sensor."""
    world = box_world.World()
    world.box(0.0, 8.0, (60.0, 0.5, 5.0))
    for x, wide, high in ((-5.0, 0.5, 2.5), (-2.5, 0.7, 3.0), (3.5, 0.4, 1.5), (5.5, 0.8, 2.0)):
        world.box(x, 7.6, (wide, 0.4, high))
    for x, y, size in (
        (0.0, 4.0, (2.0, 1.6, 1.2)),
        (-0.9, 3.8, (0.9, 0.8, 2.2)),
        (0.9, 4.1, (0.8, 0.9, 1.8)),
    ):
        world.box(x + aside, y, size, 0.7)
    pose = box_world.sensor_pose(*at, 1.8, 90.0)
    points = box_world.scan(world, "rings64", pose, np.random.default_rng(seed))
    narrow: Array = points[np.abs(np.arctan2(points[:, 1], points[:, 0])) < 0.7]
    return narrow


def evidence(source: Array, target: Array, shift: float) -> PoseEvidence:
    """Of the pose that moves the source along the wall."""
    T = se3.from_rt(np.eye(3), np.array([-0.3, shift, 0.0]))
    return PoseEvidence(views.of(VoxelGrid()(Pair.of(source, target))), T)


@pytest.fixture(scope="module")
def source() -> Array:
    return seen(0.0, (0.0, -1.3), 0)


def test_a_pose_that_follows_what_moved_is_told(source: Array) -> None:
    # The sensors look along y of the world, which is x of theirs; what moved to the right moved along their -y.
    target = seen(MOVED, (0.0, -1.0), 1)
    following = evidence(source, target, -MOVED).one_thing
    assert following is not None
    assert abs(following[1]) > 0.95
    result = hr.register(source, target)
    assert abs(result.transformation[1, 3] + MOVED) < 0.1
    assert result.verdict == "doubtful"
    assert "one thing alone holds the pose" in result.reasons[0]


def test_where_nothing_moved_none_is_told(source: Array) -> None:
    assert evidence(source, seen(0.0, (0.0, -1.0), 1), 0.0).one_thing is None
