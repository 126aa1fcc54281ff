# SPDX-License-Identifier: MIT
"""The map of a floor of several rooms, and a scan in one of them."""

from __future__ import annotations

import numpy as np

from hybridreg.data.hard.indoors import floor, stand_in
from hybridreg.data.hard.rooms import METRES
from hybridreg.data.hard.shared_surface import Bar, judged
from hybridreg.data.hard.sights import AROUND, LIDARS, level, lidar, look, merged, pose, thin
from hybridreg.data.hard.true_poses import Sample
from hybridreg.geometry import se3

# One room among many must be distinguishable from the others.
_ROOM = Bar(facing=100.0, drop=0.12)


def building(rng: np.random.Generator, seed: int) -> Sample:
    """A scan in one room against the map of the whole floor, thinned to 5 to 10 cm."""
    place, rooms = floor(rng)
    world, height = place.world(), rng.uniform(0.8, 1.6)
    rays = lidar("hemisphere" if rng.random() < 0.5 else "rings32", rng, far=30.0, columns=500)
    corridor = rooms[-1]
    along = np.arange(-corridor.half_x + 1.5, corridor.half_x - 1.0, 4.0)
    stops = [(float(x), 0.0) for x in along] + [stand_in(place, here, rng) for here in rooms[:-1]]
    shots = [look(world, rays, level(rng, x, y, height), rng) for x, y in stops]
    frame = {
        "first": shots[0].T_world,
        "floor": pose(stops[0][0], stops[0][1], rng.uniform(-0.05, 0.05), rng.uniform(0, 360)),
        "corner": pose(-corridor.half_x, min(r.y - r.half_y for r in rooms), 0.0, rng.choice([0.0, 90.0])),
    }[str(rng.choice(["first", "floor", "corner"]))]
    fused = thin(merged(shots, frame), rng.uniform(0.05, 0.1))
    here = rooms[rng.integers(len(rooms) - 1)]
    name = str(rng.choice(LIDARS if rng.random() < 0.4 else AROUND))
    x, y = stand_in(place, here, rng)
    T = level(rng, x, y, rng.uniform(0.6, 1.6))
    scan = look(world, lidar(name, rng, far=30.0), T, rng)
    # The same place in every other room is a repetition if the scan fits there as well.
    rivals = [
        se3.from_rt(se3.yaw(turn)[:3, :3], np.array([other.x, other.y, 0.0]))
        @ se3.from_rt(np.eye(3), -np.array([here.x, here.y, 0.0]))
        for other in rooms[:-1]
        for turn in (0.0, 180.0)
        if other is not here or turn
    ]
    return judged(scan, fused, METRES, 0.12, rivals, _ROOM)
