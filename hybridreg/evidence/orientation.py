# SPDX-License-Identifier: MIT
"""A pose must not turn the world upside down, nor put a sensor below the ground.

Surfaces alone do not show it: with a street upside down on another the whole ground agrees, and everything on it lies
where no sensor looked.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.views import View
from hybridreg.geometry import se3

Array = NDArray[np.float64]

# Cosine between the upward normals of two grounds below which one is upside down; by hand.
_UPSIDE_DOWN = -0.5
# Cosine above which both face up; by hand.
_BOTH_UP = 0.5
# How far one ground may lie from the other's plane, as it rises and falls: in thicknesses of the ground; by hand.
_THICK = 3.0
# Metres more for each metre of distance; by hand.
_SLOPE = 0.15


def overturned(source: View, target: View, T_target_source: Array) -> bool:
    """Whether a pose (4, 4) puts one ground upside down on the other, or a sensor well below the other's ground.

    False where the clouds do not show it, or gravity is not known.
    """
    return _under(source, target, T_target_source) or _under(target, source, se3.inverse(T_target_source))


def _under(a: View, b: View, T_b_a: Array) -> bool:
    # A sensor whose cloud shows no ground, or one on the wrong side of it, may not stand where it is taken to.
    if a.ground is None or b.ground is None:
        return False
    place, other = se3.apply(T_b_a, a.centre[None])[0], b.centre
    slack = _THICK * b.thickness + _SLOPE * float(np.linalg.norm(place - other))
    cosine = float(b.ground.up @ T_b_a[:3, :3] @ a.ground.up)
    if cosine > _BOTH_UP:
        return a.image is not None and float(b.ground.above(place[None])[0]) < -slack
    if cosine > _UPSIDE_DOWN:
        return False
    if a.ground.upright and b.ground.upright:
        return True
    # The foot of one sensor on its own ground, turned over, against the other ground: a ceiling taken for a ground lies
    # a storey away.
    foot = place - float(a.ground.above(a.centre[None])[0]) * T_b_a[:3, :3] @ a.ground.up
    return abs(float(b.ground.above(foot[None])[0])) < slack
