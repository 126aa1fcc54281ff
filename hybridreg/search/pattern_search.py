# SPDX-License-Identifier: MIT
"""The best supported pose near a pose, found by trying its neighbours.

On a field the ground pulls everywhere and the few things that stand on it pull from near by only: surfaces settle half
a metre or two beside the right pose, where the support has long begun to rise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import log_odds
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.geometry.main_axes import main_axes
from hybridreg.geometry.stencil import NEIGHBOURS

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
_STRIDE, _ROUNDS = 2, 15


def climb(both: Views, T_target_source: Array) -> PoseEvidence:
    """Where a pattern search for higher log-odds (Hooke and Jeeves 1961) ends that begins at a pose (4, 4).

    Only the three motions that leave the commonest surface (the ground) where it is are tried. The pose is not settled
    afterwards: surfaces might draw it back.
    """
    source, spacing = both.source, both.spacing
    up = main_axes(both.target.normals)[0]
    along = np.linalg.svd(up[None])[2][1:]  # (2, 3), orthogonal to it
    arm = float(np.quantile(np.linalg.norm(source.points - both.middle, axis=1), _ARM)) or spacing

    T, step = T_target_source, _FIRST
    best = log_odds.of(both, T, _STRIDE)
    for _ in range(_ROUNDS):
        for motions in _NEIGHBOURS:
            around = np.array([_moved(T, both.middle, m, step * spacing, along, up, arm) for m in motions])
            values = log_odds.of_each(both, around, _STRIDE)
            highest = int(np.argmax(values))
            if values[highest] > best:
                T, best = around[highest], values[highest]
                break
        else:
            if step <= _LAST:
                break
            step /= 2.0
    return PoseEvidence(both, T)


def _moved(T: Array, middle: Array, motion: Array, step: float, along: Array, up: Array, arm: float) -> Array:
    centre = se3.apply(T, middle)[0]
    turn = se3.rotation_about(motion[2] * _TURN * step / arm * up)
    return se3.about(centre, turn, step * motion[:2] @ along) @ T
