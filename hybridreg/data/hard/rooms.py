# SPDX-License-Identifier: MIT
"""Scans in rooms: depth cameras, LiDARs and 2-D scanners."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.hard.indoors import Room, floor, room, stand_in
from hybridreg.data.hard.place import Place
from hybridreg.data.hard.shared_surface import Bar, flip_about, judged, turn_about
from hybridreg.data.hard.sights import AROUND, LIDARS, Rays, Shot, camera, level, lidar, look, planar, pose
from hybridreg.data.hard.true_poses import Sample
from hybridreg.geometry import se3

Array = NDArray[np.float64]
# Metres: a scan in a room is right within the first, and surface is compared in voxels of the second.
METRES = 0.2
GRAIN = 0.08
_PLANE = Bar(facing=25.0, drop=0.15, axes=2)
# The optical frame in a frame that looks along x: z forward, x right, y down.
OPTICAL = se3.from_rt(np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]]), np.zeros(3))


def depth_room(rng: np.random.Generator, seed: int) -> Sample:
    """A depth camera against another one that is turned by 20 to 60 degrees, or a LiDAR in the same room."""
    place, here = room(rng)
    world, at = place.world(), np.array(stand_in(place, here, rng))
    # Roughly towards the middle: a camera that sees nothing but one bare wall has no information.
    yaw = np.degrees(np.arctan2(here.y - at[1], here.x - at[0])) + rng.normal(0.0, 25.0)
    source = look(world, _depth(rng), _held(rng, at, yaw), rng)
    if rng.random() < 0.6:
        near, yaw = _beside(place, here, rng, at, yaw)
        target = _framed(look(world, _depth(rng), _held(rng, near, yaw), rng), rng)
    else:
        name = str(rng.choice(["rings16", "hemisphere"]))
        x, y = stand_in(place, here, rng)
        T = level(rng, x, y, rng.uniform(0.3, 1.0))
        target = look(world, lidar(name, rng), T, rng)
    return judged(_framed(source, rng), target, METRES, GRAIN, _quarter_turns(here))


def lidars(rng: np.random.Generator, seed: int) -> Sample:
    """Two ordinary LiDAR scans of a room."""
    place, here = room(rng)
    world, shots = place.world(), []
    for names in (LIDARS, AROUND):
        x, y = stand_in(place, here, rng)
        T = level(rng, x, y, rng.uniform(0.6, 1.6))
        shots.append(look(world, lidar(str(rng.choice(names)), rng), T, rng))
    return judged(shots[0], shots[1], METRES, GRAIN, _quarter_turns(here))


def flat(rng: np.random.Generator, seed: int) -> Sample:
    """Two 2-D scans of a room or a floor: every z is zero."""
    if rng.random() < 0.5:
        place, here = room(rng, (8, 18))
    else:
        place, rooms = floor(rng)
        here = rooms[rng.integers(len(rooms))]
    height, world = rng.uniform(0.15, 0.65), place.world()
    first, second = stand_in(place, here, rng), stand_in(place, here, rng)
    shots = []
    for at in (first, second):
        beams, span = int(rng.choice([360, 720, 1080, 1440])), float(rng.choice([270.0, 360.0]))
        rays = planar(beams, span, rng.uniform(12.0, 30.0), rng.uniform(0.005, 0.03))
        shots.append(look(world, rays, level(rng, at[0], at[1], height, 0.0), rng))
    # A plane has no upper side: a pose that flips it mirrors the room.
    rivals = _quarter_turns(here) + [flip_about(here.x, here.y, height, axis) for axis in (0, 1)]
    return judged(shots[0], shots[1], METRES, 0.1, rivals, _PLANE)


def _depth(rng: np.random.Generator) -> Rays:
    # 1 to 2 mm at close range, up to 10 mm at 6 m.
    return camera((60.0, 45.0), 6.0, rng.uniform(0.001, 0.002), rng.uniform(0.5, 2.2) * 1e-4, near=0.4)


def _held(rng: np.random.Generator, at: Array, yaw: float) -> Array:
    return pose(at[0], at[1], rng.uniform(0.9, 1.7), yaw, rng.uniform(5.0, 33.0), rng.normal(0.0, 3.0))


def _beside(place: Place, here: Room, rng: np.random.Generator, at: Array, yaw: float) -> tuple[Array, float]:
    # A camera that looks at the same spot from 20 to 60 degrees aside; from the same place where there is no room.
    focus, turned = at + 2.0 * _way(yaw), yaw
    for _ in range(40):
        turned = yaw + rng.choice([-1, 1]) * rng.uniform(20.0, 60.0)
        near = focus - rng.uniform(1.2, 2.6) * _way(turned)
        if place.free(near[0], near[1], 0.3) and _inside(here, near):
            return near, turned
    return at, turned


def _way(yaw: float) -> Array:
    return np.array([np.cos(np.radians(yaw)), np.sin(np.radians(yaw))])


def _framed(shot: Shot, rng: np.random.Generator) -> Shot:
    return shot.within(shot.T_world @ OPTICAL) if rng.random() < 0.5 else shot


def _inside(here: Room, at: Array) -> bool:
    return abs(at[0] - here.x) < here.half_x - 0.3 and abs(at[1] - here.y) < here.half_y - 0.3


def _quarter_turns(here: Room) -> list[Array]:
    return [turn_about(here.x, here.y, angle) for angle in (90.0, 180.0, 270.0)]
