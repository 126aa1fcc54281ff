# SPDX-License-Identifier: MIT
"""A thing that stands alone on flat ground, seen by both sensors from one side, as far as the pose goes.

A house, a van or a box on a table looks from behind much as it does from in front: a pose that lays its back on its
front lets nearly all points agree, and the true one lays hardly any surface on another. Where everything else is flat,
nothing tells which of the two it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.evidence.views import View
from hybridreg.geometry import se3
from hybridreg.geometry.ground import Ground
from hybridreg.geometry.ground_relief import TELLS
from hybridreg.scene import SIDES, Scene

Array = NDArray[np.float64]

# All by hand. On no real pair of vehicle LiDARs is the first more than 0.8: things stand all around. Of 14 right poses
# of rooms (hard kinds with even seeds) both hold of one.
_FAR = 1.3  # the sensor's distance from the middle of the things over their extent, at least
_NARROW = 0.97  # angle that the things fill over the angle that the ground fills, at most
_OFF_GROUND = 3.0  # heights over the ground, thicknesses, from which a point belongs to a thing
_MOST = 90.0  # per cent of the points that make an extent or an angle
_FEWEST = 20  # points of a thing
_ONE_SIDE_DEG = 30.0  # angle between the directions from which both sensors look at it


class _Thing(NamedTuple):
    centre: Array
    up: Array


def opposite(scene: Scene, at: PoseEvidence) -> Array | None:
    """The pose (4, 4) that lays what the source shows on the other side of the same thing, roughly: as deep as it is
    thick, which nothing shows. None where more than one thing on flat ground is seen, or it is seen from two sides.
    """
    if at.agreement.relief.information > TELLS:
        return None
    things = []
    for side in SIDES:
        view, ground = getattr(at.views, side), scene.level(side).ground
        thing = None if view.image is None or ground is None else _thing(view, ground)
        if thing is None:
            return None
        things.append(thing)
    centre, up = things[1]
    places = se3.apply(at.T, at.views.source.centre[None])[0], at.views.target.centre
    a, b = (_level(place - centre, up) for place in places)
    if float(a @ b) < np.cos(np.radians(_ONE_SIDE_DEG)) * float(np.linalg.norm(a) * np.linalg.norm(b)):
        return None
    turned: Array = se3.about(centre, se3.rotation_about(np.pi * up)) @ at.T
    return turned


def _thing(view: View, ground: Ground) -> _Thing | None:
    off = np.abs(ground.above(view.points)) > _OFF_GROUND * view.thickness
    if min(np.count_nonzero(off), np.count_nonzero(~off)) < _FEWEST:
        return None
    points, up = view.points[off], ground.up
    centre = np.median(points, axis=0)
    extent = np.percentile(np.linalg.norm(points - centre, axis=1), _MOST)
    ahead = _level(centre - view.centre, up)
    far = float(np.linalg.norm(ahead))
    if far < _FAR * extent:
        return None
    aside = np.cross(up, ahead)

    def filled(some: Array) -> float:
        rays = some - view.centre
        return float(np.percentile(np.abs(np.arctan2(rays @ aside, rays @ ahead)), _MOST))

    return _Thing(centre, up) if filled(points) < _NARROW * filled(view.points[~off]) else None


def _level(vector: Array, up: Array) -> Array:
    level: Array = vector - (vector @ up) * up
    return level
