# SPDX-License-Identifier: MIT
"""The best supported pose near a pose, found by trying its neighbours.

On a field the ground pulls everywhere and the few things that stand on it pull from near by only: surfaces settle half
a metre or two beside the right pose, where the support has long begun to rise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import support, views
from hybridreg.geometry import se3
from hybridreg.geometry.main_axes import main_axes
from hybridreg.geometry.stencil import NEIGHBOURS
from hybridreg.scene import Scene
from hybridreg.search.rivals import Rival

Array = NDArray[np.float64]

# First and last step along the commonest surface, in spacings.
_FIRST, _LAST = 1.0, 0.375
# A turn moves points at this quantile of the distances from the middle by so many steps.
_ARM, _TURN = 0.7, 1.5
# Neighbours by both shifts along the commonest surface and the turn about its normal: first those that move by one of
# them, and where none is better all others.
_MOVED = np.count_nonzero(NEIGHBOURS, axis=1)
_NEIGHBOURS = (NEIGHBOURS[_MOVED == 1], NEIGHBOURS[_MOVED > 1])
# So many-th of the asked points are looked at; rounds at most, as along a corridor the support may rise for ever.
_EVERY, _ROUNDS = 2, 15


def climb(scene: Scene, T_target_source: Array) -> Rival:
    """Where a pattern search for more support (Hooke and Jeeves 1961) ends that begins at a pose (4, 4).

    Only the three motions that leave the commonest surface (the ground) where it is are tried. The pose is not settled
    afterwards: surfaces might draw it back.
    """
    source, target = views.views(scene)
    spacing = views.spacing(scene)
    up = main_axes(target.normals)[0]
    along = np.linalg.svd(up[None])[2][1:]  # (2, 3), orthogonal to it
    middle = source.points.mean(axis=0)
    arm = float(np.quantile(np.linalg.norm(source.points - middle, axis=1), _ARM)) or spacing

    T, step = T_target_source, _FIRST
    best = support.of(source, target, T, spacing, _EVERY)
    for _ in range(_ROUNDS):
        for motions in _NEIGHBOURS:
            around = np.array([_moved(T, middle, m, step * spacing, along, up, arm) for m in motions])
            values = support.of_each(source, target, around, spacing, _EVERY)
            highest = int(np.argmax(values))
            if values[highest] > best:
                T, best = around[highest], values[highest]
                break
        else:
            if step <= _LAST:
                break
            step /= 2.0
    return Rival(T, support.of(source, target, T, spacing))


def _moved(T: Array, middle: Array, motion: Array, step: float, along: Array, up: Array, arm: float) -> Array:
    centre = se3.apply(T, middle[None])[0]
    turn = se3.rotation_about(motion[2] * _TURN * step / arm * up)
    return se3.about(centre, turn, step * motion[:2] @ along) @ T
