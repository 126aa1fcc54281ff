# SPDX-License-Identifier: MIT
"""A pose that rests on the vehicle that carries the sensor is told, and not "ok"; where what stands farther off agrees,
none is told."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import box_world
from hybridreg.evidence import views
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.pair import Pair

Array = NDArray[np.float64]
# A digger around its sensor: engine, boom, bucket and cab; x, y, size, yaw.
CARRIER = (
    (-1.9, 0.3, (1.2, 2.0, 2.1)),
    (2.3, 0.7, (2.6, 0.4, 1.7)),
    (3.9, 0.7, (0.7, 1.0, 2.0)),
    (0.9, -1.4, (1.2, 0.8, 2.6)),
)


def seen(place: int, seed: int) -> Array:
    """The carrier on open ground, with a few boxes about that differ from place to place."""
    rng, world = np.random.default_rng(place), box_world.World()
    for x, y, size in CARRIER:
        world.box(x, y, size)
    for _ in range(6):
        turn, far = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(12.0, 30.0)
        size = (rng.uniform(0.3, 0.8), rng.uniform(0.3, 0.8), rng.uniform(1.5, 4.0))
        world.box(far * np.cos(turn), far * np.sin(turn), size, rng.uniform(0.0, 3.0))
    pose = box_world.sensor_pose(0.0, 0.0, 1.9, 0.0)
    return box_world.scan(world, "rings32", pose, np.random.default_rng(seed))


def as_they_lie(source: Array, target: Array) -> PoseEvidence:
    """Of the pose that leaves the sensor where it was on its carrier."""
    return PoseEvidence(views.of(VoxelGrid()(Pair.of(source, target))), np.eye(4))


@pytest.fixture(scope="module")
def source() -> Array:
    return seen(place=1, seed=0)


def test_of_two_places_that_one_carrier_saw_the_pose_is_not_ok(source: Array) -> None:
    target = seen(place=2, seed=1)
    assert as_they_lie(source, target).own_carrier is not None
    result = hr.register(source, target, preset="verify")
    assert result.verdict != "ok"
    assert any("the vehicle that carries them" in reason for reason in result.reasons)


def test_of_one_place_none_is_told(source: Array) -> None:
    target = seen(place=1, seed=1)
    assert as_they_lie(source, target).own_carrier is None
    assert "carries" not in " ".join(hr.register(source, target, preset="verify").reasons)
