# SPDX-License-Identifier: MIT
"""Fused maps of many stops against a scan, in frames whose origin is a sensor's position or not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.hard.outdoors import outdoors
from hybridreg.data.hard.outings import GRAIN, METRES, base, mount, next_to
from hybridreg.data.hard.place import Place
from hybridreg.data.hard.shared_surface import judged
from hybridreg.data.hard.sights import AROUND, LIDARS, Shot, lidar, look, merged, pose, thin
from hybridreg.data.hard.true_poses import Sample

Array = NDArray[np.float64]


def map_ground(rng: np.random.Generator, seed: int) -> Sample:
    """A map whose origin lies in or near the ground, in a building or far away."""
    place, fused = _mapped(rng, seed)
    return _against(rng, place, fused.within(_frame(place, fused, rng)), fused.T_world)


def map_sensor(rng: np.random.Generator, seed: int) -> Sample:
    """A map in the frame of its first scan."""
    place, fused = _mapped(rng, seed)
    return _against(rng, place, fused, fused.T_world)


def _mapped(rng: np.random.Generator, seed: int) -> tuple[Place, Shot]:
    # Stops along a bent path through the middle, or two that cross; the frame is the first scan's.
    place = outdoors(rng, seed)
    n, step = int(rng.integers(15, 31)), rng.uniform(1.5, 7.0)
    along = (np.arange(n) - n / 2) * min(step, 130.0 / n)
    across = 1.5 * np.sin(along / 15 + rng.uniform(0, 6))
    path = np.c_[along, across]
    if rng.random() < 0.3:
        path[1::2] = path[1::2, ::-1]
    stops = [base(place, x, y, rng.uniform(-20, 20)) for x, y in path if place.free(x, y, 0.6)]
    rays = lidar(str(rng.choice(AROUND[:3])), rng, far=rng.uniform(35, 60), columns=360)
    T_mount, world = mount(rng), place.world()
    shots = [look(world, rays, T @ T_mount, rng) for T in stops]
    return place, thin(merged(shots, shots[0].T_world), rng.uniform(0.2, 0.3))


def _against(rng: np.random.Generator, place: Place, fused: Shot, T_first: Array) -> Sample:
    middle = np.median(fused.within(np.eye(4)).points, axis=0)
    near = base(place, 0.3 * T_first[0, 3] + 0.7 * middle[0], 0.0, 0.0)
    at = next_to(place, rng, near, 0.0, 8.0) @ mount(rng)
    scan = look(place.world(rng, (at,)), lidar(str(rng.choice(LIDARS)), rng), at, rng)
    source, target = (scan, fused) if rng.random() < 0.75 else (fused, scan)
    return judged(source, target, METRES, GRAIN)


def _frame(place: Place, fused: Shot, rng: np.random.Generator) -> Array:
    where = rng.choice(["on", "in", "over", "below", "wall", "far"], p=[0.2, 0.2, 0.2, 0.12, 0.14, 0.14])
    first = fused.T_world
    x, y = first[:2, 3] + rng.uniform(-3.0, 3.0, 2)
    yaw = rng.uniform(0.0, 360.0)
    if where == "far":
        turn, far = rng.uniform(0.0, 6.28), rng.uniform(200.0, 900.0)
        return pose(x + far * np.cos(turn), y + far * np.sin(turn), rng.uniform(-60.0, 60.0), yaw)
    if where == "wall":
        walls = [rect for rect in place.rects if min(rect[2:4]) > 0.8 and np.hypot(*rect[:2]) < 40.0]
        if walls:
            x, y, *_ = walls[rng.integers(len(walls))]
        return pose(x, y, rng.uniform(0.2, 2.0), yaw)
    ground = float(place.height(x, y))
    lift = {"on": 0.0, "in": -rng.uniform(0, 0.2), "over": rng.uniform(0, 0.2), "below": -rng.uniform(1, 8)}
    return pose(x, y, ground + lift[str(where)], yaw)
