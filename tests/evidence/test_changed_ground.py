# SPDX-License-Identifier: MIT
"""Ground that was raised or dug away between two scans is told; ground that lies as it did is not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import box_world
from hybridreg.data.hard.box_world import World
from hybridreg.evidence import views
from hybridreg.evidence.deformation.changed_ground import ChangedGround, changed_ground
from hybridreg.geometry import se3
from hybridreg.pair import Pair

Array = NDArray[np.float64]


def depot(rng: np.random.Generator) -> World:
    """Sheds, and stacks whose tops a sensor at 1.8 m looks down on."""
    world = World()
    for x, y in ((-22.0, 3.0), (24.0, -4.0), (2.0, 25.0), (-3.0, -23.0)):
        world.box(x, y, (rng.uniform(6, 12), rng.uniform(6, 12), rng.uniform(5, 8)), rng.uniform(0, 1))
    for _ in range(30):
        x, y = rng.uniform(-18, 18, 2)
        if np.hypot(x, y) > 3:
            world.box(
                x, y, (rng.uniform(2, 5), rng.uniform(1.5, 3), rng.uniform(0.9, 1.4)), rng.uniform(0, np.pi)
            )
    return world


def on_raised_ground(world: World, metres: float) -> World:
    """What is left to see of a world whose ground was raised, from that ground as z = 0; dug away below 0 metres."""
    lower = np.array([0.0, 0.0, 0.5 * metres])  # boxes end at the ground
    return World(boxes=[(centre - lower, half - lower, yaw) for centre, half, yaw in world.boxes])


def scans(
    seed: int, metres: float, sensors: tuple[str, str] = ("rings64", "rings64")
) -> tuple[Array, Array, Array]:
    """Source and target (n, 3), the target's ground raised by so many metres, and the pose that lays what stands."""
    rng = np.random.default_rng(seed)
    world = depot(rng)
    poses = [box_world.sensor_pose(0.0, 0.0, 1.8, 30.0), box_world.sensor_pose(3.0, 1.0, 1.8, -60.0)]
    source = box_world.scan(world, sensors[0], poses[0], rng)
    target = box_world.scan(on_raised_ground(world, metres), sensors[1], poses[1], rng)
    poses[1][2, 3] += metres
    return source, target, se3.inverse(poses[1]) @ poses[0]


def found(source: Array, target: Array, T: Array) -> ChangedGround | None:
    return changed_ground(views.of(VoxelGrid(voxel=0.4)(Pair.of(source, target))), T)


def ground_on_ground(T: Array, metres: float) -> Array:
    laid = T.copy()
    laid[2, 3] += metres
    return laid


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("metres", [0.6, -0.7])
def test_ground_that_changed_is_told(seed: int, metres: float) -> None:
    source, target, truth = scans(seed, metres)
    T = ground_on_ground(truth, metres)
    changed = found(source, target, T)
    assert changed is not None
    assert changed.metres == pytest.approx(metres, abs=0.1)
    back = found(target, source, se3.inverse(T))
    assert back is not None
    assert back.metres == pytest.approx(-metres, abs=0.1)


@pytest.mark.parametrize(
    "sensors", [("rings64", "rings64"), ("rings32", "rings64"), ("hemisphere", "rings32")]
)
def test_ground_that_lies_as_it_did_is_not(sensors: tuple[str, str]) -> None:
    for seed in range(3):
        source, target, truth = scans(seed, 0.0, sensors)
        assert found(source, target, truth) is None


def test_a_pose_that_follows_the_ground_is_doubted_in_words() -> None:
    source, target, truth = scans(2, -0.7)
    result = hr.register(source, target)
    assert result.transformation[2, 3] - truth[2, 3] == pytest.approx(-0.7, abs=0.1)
    assert result.verdict == "doubtful"
    told = "fits better when the ground of the source is taken to lie 0.7"
    assert any(told in reason for reason in result.reasons), result.reasons
    there = scans(2, 0.0)
    assert hr.register(*there[:2]).verdict == "ok"
