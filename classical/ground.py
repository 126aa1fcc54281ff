# SPDX-License-Identifier: MIT
"""The ground of one cloud, in whatever way its sensor hung."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.normals import surface
from hybridreg.scene import Level, Scene

Array = NDArray[np.float64]

# Points that face up within 25 degrees may be ground; it must hold a tenth of the cloud, with a tenth below at most.
_FACES_UP = float(np.cos(np.radians(25.0)))
_LEAST, _MOST_BELOW = 0.1, 0.1
# Half the thickness of the ground, in spacings.
_THICK = 1.5


class Ground(NamedTuple):
    """A level plane: `up` (3,) unit, towards the sensor; `height` metres of the plane along it."""

    up: Array
    height: float

    def above(self, points: Array) -> Array:
        """Heights (n,) of points (n, 3) over the ground, metres."""
        return points @ self.up - self.height


def find(scene: Scene, side: Literal["source", "target"]) -> Ground | None:
    """Ground of one level, or None where no plane below the sensor carries enough of the points."""
    return scene.shared(("ground", side), lambda: _find(scene, side))


def _find(scene: Scene, side: Literal["source", "target"]) -> Ground | None:
    level: Level = getattr(scene, side)
    viewpoint = level.viewpoint
    if viewpoint is None:
        return None
    normals, planarity = surface(scene, side)
    _, axes = np.linalg.eigh((normals * planarity[:, None]).T @ normals)
    # Walls may outnumber the ground: the commonest direction is tried first, then the others.
    for axis in axes.T[::-1]:
        for up in (axis, -axis):
            ground = _under(level, viewpoint, normals, up)
            if ground is not None:
                return ground
    return None


def _under(level: Level, viewpoint: Array, normals: Array, up: Array) -> Ground | None:
    along = level.points @ up
    floor = along[np.abs(normals @ up) > _FACES_UP]
    floor = floor[floor < viewpoint @ up]
    if len(floor) < _LEAST * len(along):
        return None
    # The fullest layer as thick as the ground.
    layer = 2.0 * _THICK * level.spacing
    lowest = np.sort(floor)
    held = np.searchsorted(lowest, lowest + layer) - np.arange(len(lowest))
    first = int(np.argmax(held))
    height = float(np.median(lowest[first : first + held[first]]))
    if held[first] < _LEAST * len(along) or np.mean(along < height - layer) > _MOST_BELOW:
        return None
    return Ground(up, height)
