# SPDX-License-Identifier: MIT
"""How many points meet under each shift: counted among the cells that hold a point, whatever the cloud's extent."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import box_world
from hybridreg.evidence import views
from hybridreg.evidence.agreement import compare
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.resolution import VEHICLES
from hybridreg.scene import Scene
from hybridreg.search.near_copies import near_copies
from hybridreg.search.occupied_cells import OccupiedCells
from hybridreg.search.repeats import copies


def test_counts_are_those_of_every_shift_tried_by_itself() -> None:
    rng = np.random.default_rng(1)
    for extent in ([6.0, 6.0, 2.0], [40.0, 5.0, 1.0], [3.0, 60.0, 8.0]):
        held, points = rng.uniform(-np.array(extent), extent, (400, 3)), rng.uniform(-20.0, 20.0, (60, 3))
        cells = {tuple(cell) for cell in np.floor(held / 0.5).astype(int).tolist()}
        met = OccupiedCells(held, 0.5).met(points, (4, 6))
        for i in range(-4, 5):
            for j in range(-6, 7):
                moved = np.floor(points / 0.5).astype(int) + [i, j, 0]
                assert met[i + 4, j + 6] == sum(tuple(cell) in cells for cell in moved.tolist())


def test_a_wide_sparse_cloud_costs_no_memory() -> None:
    """Thirty-five points within hundreds of metres, cells of centimetres: a full grid took 3 GB."""
    points = np.random.default_rng(2).uniform(-300.0, 300.0, (35, 3))
    tracemalloc.start()
    met = OccupiedCells(points, 0.05).met(points, (20, 60))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert met[20, 60] == 35
    assert peak < 20e6


def corridor(begin: float, end: float, piers: list[float], seed: int) -> np.ndarray:
    """Walls, floor, ceiling, and piers that stand out from a wall at some places along x."""
    rng = np.random.default_rng(seed)

    def face(n: int, low: list[float], high: list[float]) -> np.ndarray:
        return rng.uniform(low, high, (n, 3))

    n = round(1500 * (end - begin))
    sides = [face(n, [begin, y, 0.0], [end, y, 2.5]) for y in (-1.0, 1.0)] + [
        face(n // 2, [begin, -1.0, z], [end, 1.0, z]) for z in (0.0, 2.5)
    ]
    return np.concatenate([*sides, *(face(300, [x, 0.4, 0.0], [x, 1.0, 2.5]) for x in piers)])


def test_a_place_farther_along_a_corridor_is_found_though_its_floor_is_alike_all_along() -> None:
    """`sim:val/degenerate` 84: the true pose lay 40 cells away, and the cells of the floor outnumbered those of what
    tells one place from another."""
    piers = [0.0, 0.7, 1.9]
    target = corridor(-6.0, 9.0, [*piers, *(x + 3.0 for x in piers)], seed=0)
    pair = Pair.of(corridor(-3.0, 4.0, piers, seed=1) - [0.5, 0.0, 1.3], target)
    both = views.of(Scene.on_cells(pair, 0.1))
    right = np.eye(4)
    right[:3, 3] = [0.5, 0.0, 1.3]
    found = copies(both, right, compare(both, right).axes)
    off = [float(np.linalg.norm(T[:3, 3] - right[:3, 3] - [3.0, 0.0, 0.0])) for T in found]
    assert 20.0 * both.spacing < 3.0
    assert min(off) < 0.25


def tower(turn_deg: float, up: float, seed: int) -> np.ndarray:
    """A yard of boxes, seen from its middle."""
    rng, made = np.random.default_rng(7), np.random.default_rng(seed)
    parts = [np.c_[made.uniform(-12.0, 12.0, (6000, 2)), np.full(6000, -1.7)]]
    for _ in range(14):
        centre, size = rng.uniform(-10.0, 10.0, 2), rng.uniform(0.6, 2.0)
        box = made.uniform(-0.5, 0.5, (500, 3))
        face = made.integers(0, 2, 500)
        box[np.arange(500), face] = np.sign(box[np.arange(500), face]) * 0.5
        parts.append(np.c_[centre + size * box[:, :2], 2.5 * (box[:, 2] + 0.5) - 1.7])
    return se3.apply(se3.yaw(turn_deg), np.concatenate(parts)) + [0.0, 0.0, up]


@pytest.mark.parametrize(("turn_deg", "up"), [(40.0, 0.0), (155.0, 0.0), (0.0, 3.6)])
def test_a_map_that_holds_a_place_turned_or_raised_shows_both(turn_deg: float, up: float) -> None:
    target = np.concatenate([tower(0.0, 0.0, seed=0), tower(turn_deg, up, seed=1)])
    both = views.of(Scene.on_cells(Pair.of(tower(0.0, 0.0, seed=2), target), 0.25))
    other = se3.yaw(turn_deg)
    other[2, 3] = up
    found = copies(both, np.eye(4), compare(both, np.eye(4)).axes)
    off = [
        (se3.angle_deg(T[:3, :3] @ other[:3, :3].T), np.linalg.norm(T[:3, 3] - other[:3, 3])) for T in found
    ]
    assert any(degrees < 2.0 and metres < 0.5 for degrees, metres in off)


@pytest.mark.parametrize(
    ("turn_deg", "shift"),
    [(0.0, (0.7, 0.0, 0.0)), (0.0, (-0.4, 0.6, 0.0)), (3.0, (0.0, 0.0, 0.0)), (0.0, (0.0, 0.0, 0.7))],
)
def test_a_map_that_holds_every_wall_twice_shows_the_other_place(
    turn_deg: float, shift: tuple[float, float, float]
) -> None:
    target, copy = tower(0.0, 0.0, seed=0), se3.yaw(turn_deg)
    copy[:3, 3] = shift

    def found(map_points: np.ndarray) -> list[np.ndarray]:
        both = views.of(Scene.on_cells(Pair.of(tower(0.0, 0.0, seed=2), map_points), 0.25))
        return near_copies(both, np.eye(4), compare(both, np.eye(4)).axes, VEHICLES)

    def is_other(T: np.ndarray) -> bool:
        step = T @ se3.inverse(copy)
        return se3.angle_deg(step[:3, :3]) < 0.5 and bool(np.linalg.norm(step[:3, 3]) < 0.15)

    assert any(is_other(T) for T in found(np.concatenate([target, se3.apply(copy, target)])))
    assert not any(is_other(T) for T in found(target))


def test_a_pose_that_lays_the_clouds_apart_has_no_copies() -> None:
    both = views.of(Scene.on_cells(Pair.of(tower(0.0, 0.0, seed=2), tower(0.0, 0.0, seed=0)), 0.25))
    far = np.eye(4)
    far[0, 3] = 5000.0
    assert copies(both, far, compare(both, far).axes) == []
    assert near_copies(both, far, compare(both, far).axes, VEHICLES) == []


@pytest.mark.parametrize(
    ("teeth", "alone"), [(6, False), (8, False), (12, False), (8, True), (12, True), (14, True)]
)
def test_turns_about_a_round_thing_are_found(teeth: int, alone: bool) -> None:
    """A wheel with teeth and a block: turned by a tooth it fits, and the block alone tells."""
    world = box_world.World()
    for angle in 2.0 * np.pi * np.arange(teeth // 2) / teeth:
        world.box(0.0, 0.0, (2.7, 0.35, 0.5), angle)
    world.box(*((0.5, 0.4, (0.4, 0.5, 0.8), 0.3) if alone else (2.0, 1.5, (0.5, 0.7, 0.5), 0.3)))
    rng = np.random.default_rng(3)
    frames = [aimed(5.0 * np.array([np.cos(at), np.sin(at), 0.75])) for at in (0.4, 1.2)]
    clouds = [box_world.scan(world, "rosette", frame, rng) for frame in frames]
    for k, (frame, cloud) in enumerate(zip(frames, clouds, strict=True)):
        table = np.abs(se3.apply(frame, cloud)[:, 2]) < 0.1
        clouds[k] = cloud[~table] if alone else cloud[np.linalg.norm(cloud, axis=1) < 8.5]
    truth = se3.inverse(frames[1]) @ frames[0]
    both = views.of(VoxelGrid()(Pair.of(*clouds)))
    step = se3.inverse(frames[1]) @ se3.yaw(360.0 / teeth) @ frames[1]
    wrong = step @ truth
    found = copies(both, wrong, compare(both, wrong).axes)
    assert min(se3.angle_deg(T[:3, :3] @ truth[:3, :3].T) for T in found) < 3.0


def aimed(at: np.ndarray) -> np.ndarray:
    """A sensor (4, 4) that looks at the origin."""
    ahead = -at / np.linalg.norm(at)
    aside = np.cross([0.0, 0.0, 1.0], ahead)
    aside /= np.linalg.norm(aside)
    return se3.from_rt(np.stack([ahead, aside, np.cross(ahead, aside)], axis=1), at)
