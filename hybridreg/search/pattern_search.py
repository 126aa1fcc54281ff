# SPDX-License-Identifier: MIT
"""Pattern search: the likeliest pose near a pose, found by trying its neighbours.

On a field the ground attracts ICP everywhere and the few objects on it only from near by: a pose settles half a metre
or two beside the right one, where the log-odds have long begun to rise.
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

# First step along the commonest surface, spacings; by hand.
_FIRST = 1.0
# Last step, spacings; by hand.
_LAST = 0.375
# Quantile of the points' distances from their centroid: the arm of a rotation; by hand.
_ARM = 0.7
# Steps by which a rotation moves a point at that arm; by hand.
_TURN = 1.5
# Neighbours by both shifts along the commonest surface and the rotation about its normal: first those that change one
# of these, and where none is better all others.
_MOVED = np.count_nonzero(NEIGHBOURS, axis=1)
_NEIGHBOURS = (NEIGHBOURS[_MOVED == 1], NEIGHBOURS[_MOVED > 1])
# Stride over the sampled points: for speed.
_STRIDE = 2
# Rounds at most, as along a corridor the log-odds may rise for ever; by hand.
_ROUNDS = 15


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
