# SPDX-License-Identifier: MIT
"""Fused maps of many stops, outdoors or of a floor of several rooms, against a scan or one another; the origin of their
frames is a sensor's position or not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.hard import rooms
from hybridreg.data.hard.indoors import floor, stand_in
from hybridreg.data.hard.outdoors import outdoors
from hybridreg.data.hard.outings import GRAIN, METRES, base, mount, next_to
from hybridreg.data.hard.place import Place
from hybridreg.data.hard.shared_surface import Bar, judged
from hybridreg.data.hard.sights import AROUND, LIDARS, Shot, level, lidar, look, merged, pose, thin
from hybridreg.data.hard.true_poses import Sample
from hybridreg.geometry import se3

Array = NDArray[np.float64]
# One room among many must be distinguishable from the others.
_ROOM = Bar(facing=100.0, drop=0.12)


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


def tiles(rng: np.random.Generator, seed: int) -> Sample:
    """Two parts of one neighbourhood, mapped one after another: they share a strip, or nothing but waves of the ground,
    which repeat."""
    place = outdoors(rng, 0)
    rays = lidar(str(rng.choice(AROUND[:3])), rng, far=45.0, columns=300)
    along = np.arange(-30.0, 31.0, 6.0) + rng.uniform(-1.0, 1.0)
    path = [*np.c_[along, 0.0 * along], *np.c_[0.0 * along, along][np.abs(along) > 2.0]]
    stops = [base(place, x, y, rng.uniform(-20, 20)) @ mount(rng) for x, y in path]
    shots = [look(place.world(), rays, T, rng) for T in stops]
    over, across = rng.uniform(-5.0, 14.0), int(rng.integers(2))
    parts = []
    for side, share in ((1.0, shots[::2]), (-1.0, shots[1::2])):
        whole = merged(share, pose(0.0, 0.0, 0.0, 0.0))
        part = whole.kept(side * whole.points[:, across] < over)
        x, y = rng.uniform(-20.0, 20.0, 2)
        frame = pose(x, y, rng.uniform(-2.0, 0.0), rng.uniform(0.0, 360.0))
        parts.append(thin(part.within(frame), rng.uniform(0.2, 0.3)))
    return judged(parts[0], parts[1], METRES, GRAIN)


def building(rng: np.random.Generator, seed: int) -> Sample:
    """A scan in one room against the map of the whole floor, thinned to 5 to 10 cm."""
    place, halls = floor(rng)
    world, height = place.world(), rng.uniform(0.8, 1.6)
    rays = lidar("hemisphere" if rng.random() < 0.5 else "rings32", rng, far=30.0, columns=500)
    corridor = halls[-1]
    along = np.arange(-corridor.half_x + 1.5, corridor.half_x - 1.0, 4.0)
    stops = [(float(x), 0.0) for x in along] + [stand_in(place, here, rng) for here in halls[:-1]]
    shots = [look(world, rays, level(rng, x, y, height), rng) for x, y in stops]
    frame = {
        "first": shots[0].T_world,
        "floor": pose(stops[0][0], stops[0][1], rng.uniform(-0.05, 0.05), rng.uniform(0, 360)),
        "corner": pose(-corridor.half_x, min(r.y - r.half_y for r in halls), 0.0, rng.choice([0.0, 90.0])),
    }[str(rng.choice(["first", "floor", "corner"]))]
    fused = thin(merged(shots, frame), rng.uniform(0.05, 0.1))
    here = halls[rng.integers(len(halls) - 1)]
    name = str(rng.choice(LIDARS if rng.random() < 0.4 else AROUND))
    x, y = stand_in(place, here, rng)
    T = level(rng, x, y, rng.uniform(0.6, 1.6))
    scan = look(world, lidar(name, rng, far=30.0), T, rng)
    # The same place in every other room is a repetition if the scan fits there as well.
    rivals = [
        se3.from_rt(se3.yaw(turn)[:3, :3], np.array([other.x, other.y, 0.0]))
        @ se3.from_rt(np.eye(3), -np.array([here.x, here.y, 0.0]))
        for other in halls[:-1]
        for turn in (0.0, 180.0)
        if other is not here or turn
    ]
    return judged(scan, fused, rooms.METRES, 0.12, rivals, _ROOM)
