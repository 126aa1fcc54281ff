# SPDX-License-Identifier: MIT
"""Views of small objects by a depth camera or a hand-held scanner."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.hard.place import Place
from hybridreg.data.hard.rooms import OPTICAL
from hybridreg.data.hard.shared_surface import Bar, judged, turn_about
from hybridreg.data.hard.sights import Shot, camera, level, look, pose
from hybridreg.data.hard.true_poses import Sample
from hybridreg.geometry import se3

Array = NDArray[np.float64]
# A table may fill most of the view without saying much.
_THING = Bar(weakest=0.01)


def thing(rng: np.random.Generator, seed: int) -> Sample:
    """Two views of an object, 20 to 90 degrees apart, alone or on a table."""
    size = float(np.exp(rng.uniform(np.log(0.05), np.log(0.5))))
    place = _composed(rng, size)
    if rng.random() < 0.4:  # on a table, whose rim may be in view
        x, y, wide, deep = size * rng.uniform([-0.3, -0.3, 1.5, 1.2], [0.3, 0.3, 6.0, 4.0])
        place.box(x, y, -0.1 * size, (wide, deep, 0.1 * size), rng.uniform(0.0, np.pi))
    world, turn = place.world(), rng.uniform(0.0, 360.0)
    noise = min(rng.uniform(0.0002, 0.001), 0.01 * size)
    apart = rng.choice([-1, 1]) * rng.uniform(20.0, 90.0)
    frame = str(rng.choice(["sensor", "turntable", "shifted"], p=[0.65, 0.2, 0.15]))
    shots = []
    for yaw in (turn, turn + apart):
        far = float(np.clip(size * rng.uniform(1.8, 3.5), 0.3, 1.2))
        wide = float(np.clip(np.degrees(2.0 * np.arctan(1.1 * size / far)), 25.0, 70.0))
        rays = camera((wide, 0.75 * wide), far + 3.0 * size, noise, near=0.05)
        shots.append(look(world, rays, _aimed(rng, yaw, far, size), rng))
    source, target = (_framed(shot, frame, size, rng) for shot in shots)
    spacing = 2.0 * size / 240.0
    metres = max(0.03 * size, 2.0 * noise, spacing)
    rivals = [turn_about(0.0, 0.0, angle) for angle in (90.0, 180.0, 270.0)]
    return judged(source, target, metres, max(size / 30.0, 3.0 * noise), rivals, _THING)


def _composed(rng: np.random.Generator, size: float) -> Place:
    # A large box or cylinder, and two to five smaller ones on it and beside it.
    place = Place()
    wide, deep, high = size * rng.uniform([0.5, 0.3, 0.15], [0.75, 0.55, 0.5])
    place.box(0.0, 0.0, 0.0, (wide, deep, high), rng.uniform(0.0, np.pi))
    for k in range(rng.integers(2, 6)):
        w, d, h = size * rng.uniform(0.12, 0.4, 3)
        on_top = k == 0 or rng.random() < 0.5
        x, y = rng.uniform(-0.4, 0.4, 2) * [wide, deep] if on_top else rng.uniform(-0.42, 0.42, 2) * size
        z = high * 0.98 if on_top else 0.0
        if rng.random() < 0.6:
            place.box(x, y, z, (w, d, h), rng.uniform(0.0, np.pi))
        else:
            place.post(x, y, 0.4 * min(w, d) + 0.03 * size, h, z, sides=48)
    return place


def _aimed(rng: np.random.Generator, yaw: float, far: float, size: float) -> Array:
    # A camera that looks at the object's middle from above its height.
    up = np.radians(rng.uniform(20.0, 55.0))
    a = np.radians(yaw)
    middle = np.array([0.0, 0.0, 0.25 * size]) + rng.normal(0.0, 0.03, 3) * size
    at = middle + far * np.array([np.cos(a) * np.cos(up), np.sin(a) * np.cos(up), np.sin(up)])
    return pose(at[0], at[1], at[2], yaw + 180.0, np.degrees(up), rng.normal(0.0, 4.0))


def _framed(shot: Shot, frame: str, size: float, rng: np.random.Generator) -> Shot:
    if frame == "turntable":
        off = rng.normal(0.0, 0.02, 2) * size
        return shot.within(level(rng, off[0], off[1], 0.3 * size, lean=0.0))
    if rng.random() < 0.5:
        shot = shot.within(shot.T_world @ OPTICAL)
    if frame == "shifted":
        T = se3.from_rt(se3.rotation_about(rng.normal(0.0, 0.2, 3)), rng.normal(0.0, 0.3, 3))
        return shot.within(shot.T_world @ T)
    return shot
