# SPDX-License-Identifier: MIT
"""Indoors a sensor may see more of the ceiling than of the floor: which of them is the ground."""

from __future__ import annotations

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import is_right, sample
from hybridreg.evidence import views
from hybridreg.evidence.orientation import overturned
from hybridreg.geometry import ground, normals, se3
from hybridreg.geometry.ground import Ground
from hybridreg.pair import Pair
from hybridreg.scene import Level, Scene

HEIGHT = 2.8
OVER = np.diag([1.0, -1.0, -1.0])


def room(n_floor: int, n_ceiling: int, seed: int = 0) -> np.ndarray:
    """Points of a room of 9 by 6 m with a table, seen from 1.2 m over its floor."""
    rng = np.random.default_rng(seed)
    half = np.array([4.5, 3.0])
    flat = [
        np.c_[rng.uniform(-half, half, (n, 2)), np.full(n, z)]
        for n, z in ((n_floor, 0.0), (n_ceiling, HEIGHT))
    ]
    table = np.c_[rng.uniform([1.0, 1.0], [2.2, 1.8], (120, 2)), np.full(120, 0.75)]
    walls = []
    for axis, side in ((0, -1), (0, 1), (1, -1), (1, 1)):
        wall = np.c_[rng.uniform(-half, half, (700, 2)), rng.uniform(0.0, HEIGHT, 700)]
        wall[:, axis] = side * half[axis]
        walls.append(wall)
    points = np.concatenate([*flat, table, *walls]) - [0.3, -0.2, 1.2]
    return points + rng.normal(0.0, 0.005, points.shape)


def street(upside_down: bool) -> np.ndarray:
    rng = np.random.default_rng(1)
    flat = np.c_[rng.uniform(-15, 15, (3000, 2)), np.full(3000, -1.8)]
    crowns = np.array([8.0, 3.0, 4.0]) + rng.normal(0.0, 1.0, (400, 3))
    wall = np.c_[rng.uniform(-15, 15, 800), np.full(800, 9.0), rng.uniform(-1.8, 6.0, 800)]
    points = np.concatenate([flat, crowns, wall])
    return points @ OVER if upside_down else points


def faced(points: np.ndarray, found: Ground) -> Ground | None:
    return ground.facing(points, normals.estimate(points, np.zeros(3)), found, 0.15)


def test_the_floor_lies_opposite_the_ceiling_and_the_ceiling_opposite_the_floor() -> None:
    points = room(300, 3000)
    ceiling = ground.under(points, np.zeros(3), 0.15)
    assert ceiling is not None
    assert not ceiling.upright
    floor = faced(points, ceiling)
    assert floor is not None
    assert floor.upright
    assert floor.height == pytest.approx(-1.2, abs=0.05)  # the floor, not the table
    again = faced(points, floor)
    assert again is not None
    assert again.height == pytest.approx(-(HEIGHT - 1.2), abs=0.05)


@pytest.mark.parametrize("upside_down", [False, True])
def test_nothing_lies_opposite_a_street(upside_down: bool) -> None:
    points = street(upside_down)
    found = ground.under(points, np.zeros(3), 0.15)
    assert found is not None
    assert found.upright is not upside_down
    assert faced(points, found) is None


def scene_of(source: np.ndarray, target: np.ndarray, gravity: str = "known") -> Scene:
    return Scene(
        pair=Pair.of(source, target, gravity=gravity),
        source=Level(points=source, spacing=0.15, viewpoint=np.zeros(3)),
        target=Level(points=target, spacing=0.15, viewpoint=np.zeros(3)),
    )


def test_a_floor_and_a_ceiling_become_two_floors_unless_gravity_is_unknown() -> None:
    low, high = room(3000, 300), room(300, 3000, seed=2)
    for source, target in ((low, high), (high, low)):
        found = scene_of(source, target).grounds
        assert found["source"] is not None
        assert found["source"].upright
        assert found["target"] is not None
        assert found["target"].upright
    found = scene_of(low, high, "unknown").grounds
    assert found["target"] is not None
    assert not found["target"].upright


def test_a_sensor_upside_down_in_the_open_keeps_its_ground() -> None:
    found = scene_of(street(False), street(True)).grounds
    assert found["source"] is not None
    assert found["source"].upright
    assert found["target"] is not None
    assert not found["target"].upright


def test_a_room_turned_over_onto_its_own_ceiling_is_overturned() -> None:
    low, high = room(3000, 300), room(300, 3000, seed=2)
    both = views.of(VoxelGrid(voxel=0.15)(Pair.of(low, high)))
    over = se3.from_rt(OVER, np.array([0.0, 0.0, HEIGHT - 2.4]))
    assert not overturned(both.source, both.target, np.eye(4))
    assert overturned(both.source, both.target, over)


@pytest.mark.parametrize(
    "kind, seed, word",
    [
        # Maps, rooms and tunnels where one cloud shows more of the ceiling.
        ("building", 410, "doubtful"),
        ("depth-room", 404, "ok"),
        ("tunnel", 424, "ok"),
        # And a street, whose upside-down sensor has trees opposite its ground.
        ("upside-down", 406, "ok"),
    ],
)
def test_rooms_are_found_upright(kind: str, seed: int, word: str) -> None:
    made = sample(kind, seed)
    result = hr.register(made.source, made.target)
    assert is_right(made, result.transformation)
    assert result.verdict == word
    assert any("hangs upside down" in note for note in result.notes) is (kind != "upside-down")
