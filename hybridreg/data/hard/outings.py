# SPDX-License-Identifier: MIT
"""Where vehicles and sensors stand outdoors, and what they see from there."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.hard.outdoors import outdoors
from hybridreg.data.hard.place import Place
from hybridreg.data.hard.sights import AHEAD, LIDARS, Shot, lidar, look, pose
from hybridreg.geometry import se3

Array = NDArray[np.float64]
# Metres: a scan outdoors is right within the first, and surface is compared in voxels of the second.
METRES = 0.5
GRAIN = 0.3


def base(place: Place, x: float, y: float, yaw: float) -> Array:
    """Pose (4, 4) of a vehicle's frame on the ground."""
    return pose(x, y, float(place.height(x, y)), yaw)


def stand(place: Place, rng: np.random.Generator, clearance: float = 1.2) -> Array:
    """A free position near the middle, any yaw."""
    return _near(place, rng, 0.0, 0.0, 0.0, 6.0, clearance)


def next_to(place: Place, rng: np.random.Generator, first: Array, low: float, high: float) -> Array:
    """A free position `low` to `high` metres from `first` (4, 4), any yaw."""
    return _near(place, rng, first[0, 3], first[1, 3], low, high, 1.2)


def _near(
    place: Place, rng: np.random.Generator, x: float, y: float, low: float, high: float, clearance: float
) -> Array:
    at = (x, y)
    for k in range(300):
        turn, far = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(low, high)
        at = (x + far * np.cos(turn), y + far * np.sin(turn))
        if place.free(*at, clearance if k < 250 else 0.5):
            break
    return base(place, *at, rng.uniform(0.0, 360.0))


def mount(rng: np.random.Generator, lean: float = 1.0) -> Array:
    """Pose (4, 4) of a sensor in a vehicle's frame: 1.2 to 2.2 m up, `lean` degrees of pitch and roll."""
    return pose(
        rng.uniform(-0.5, 1.0), 0.0, rng.uniform(1.2, 2.2), 0.0, rng.normal(0, lean), rng.normal(0, lean)
    )


def scans(
    rng: np.random.Generator,
    seed: int,
    names: tuple[tuple[str, ...], tuple[str, ...]] = (LIDARS, LIDARS),
    apart: tuple[float, float] = (1.0, 15.0),
    mounts: tuple[Array, Array] | None = None,
) -> tuple[Shot, Shot, tuple[Array, Array]]:
    """Source and target scan of one place in their sensors' frames, and the poses of the two vehicles."""
    place = outdoors(rng, seed)
    second = stand(place, rng)
    first = next_to(place, rng, second, *apart)
    lidars = tuple(str(rng.choice(side)) for side in names)
    if set(lidars) <= set(AHEAD):
        first = _facing(rng, first, second)
    mounts = mounts or (mount(rng), mount(rng))
    shots = [
        look(world, lidar(name, rng), T @ T_mount, rng)
        for world, name, T, T_mount in zip(
            (place.world(rng, (first, second)), place.world()), lidars, (first, second), mounts, strict=True
        )
    ]
    return shots[0], shots[1], (first, second)


def _facing(rng: np.random.Generator, first: Array, second: Array) -> Array:
    # Two sensors that look ahead must look at the same objects.
    yaw = np.degrees(np.arctan2(second[1, 0], second[0, 0])) + rng.uniform(-30.0, 30.0)
    return se3.from_rt(se3.yaw(float(yaw))[:3, :3], first[:3, 3])
