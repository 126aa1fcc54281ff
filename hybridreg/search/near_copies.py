# SPDX-License-Identifier: MIT
"""Copies of a place just beside a pose: a map that was built badly holds every wall twice, a metre apart.

`hybridreg.search.repeats` begins where poses are two answers to every search (`hybridreg.search.ranking.differs`). What
lies between that and the tolerance takes finer cells, and turns of a few degrees without a shift.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.surface_distance import closeness, settle_closely
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.resolution import Tolerance
from hybridreg.search.moved_points import MovedPoints, peaks

Array = NDArray[np.float64]

# Edge of a cell, of the spacing or of the tolerance, whichever is less, and the farthest shift, spacings; by hand.
_CELL, _REACH = 0.5, 3.5
# Cells of the farthest shift, at most: for speed.
_FARTHEST = 16
# Turns tried with each shift, degrees; by hand.
_TURNS_DEG = tuple(np.arange(-5.0, 6.0))
# Points of each kind that are moved: for speed.
_POINTS = 120
# Share of the points that coincide at the pose which must coincide beside it: by hand; of a map that holds every wall
# twice 0.7 to 1.1.
_SHARE = 0.5
# Turns and cells of either axis within which there is one peak; by hand.
_WINDOW = (3, 5, 5)
# Guesses that are settled, at most, and of either kind those that are tried together; by hand.
_MOST, _EACH = 4, 2
# Times that each is settled: a guess is half a cell and half a degree off; by hand.
_ROUNDS = 2
# Nats per point by which the clouds must lie less closely on one another half-way between two copies than at either: by
# hand. Of maps that hold every wall twice it is 0.3 to 0.9, of poses that surfaces hold loosely less than zero.
_VALLEY = 0.15


def near_copies(views: Views, T_target_source: Array, axes: Array, allowed: Tolerance) -> list[Array]:
    """Poses (4, 4) beyond the tolerance but within some spacings of a pose, at which nearly as many points coincide,
    each where the surfaces draw it."""
    cell = _CELL * min(views.spacing, allowed.metres)
    points = MovedPoints(views, T_target_source, axes, cell, _POINTS, wide=True)
    if points.tell_nothing:
        return []
    reach = min(int(np.ceil(_REACH * views.spacing / cell)), _FARTHEST)
    middle = se3.apply(T_target_source, views.middle)[0]

    def apart(M: Array) -> bool:
        return not Tolerance.between(np.eye(4), M, middle).within(allowed)

    shifted, raised = (
        list(filter(apart, found)) for found in (_shifted(points, reach), _raised(points, reach))
    )
    both = [up @ along for along in shifted[:_EACH] for up in raised[:_EACH]]
    guesses = [*[*shifted, *raised][:_MOST], *both]
    if not guesses:
        return []
    settled = np.array([M @ T_target_source for M in guesses])
    for _ in range(_ROUNDS):
        settled = settle_closely(views.fine, settled)
    return [T for T in settled if apart(T @ se3.inverse(T_target_source))]


def are_two_places(views: Views, T_target_source: Array, copy: Array) -> bool:
    """Whether a pose and a copy of it are two places, not two ends of one that surfaces hold loosely: the clouds lie
    as closely on one another at either, and less closely half-way between."""
    centre = se3.apply(T_target_source, views.middle)[0]
    step = copy @ se3.inverse(T_target_source)
    half_turn = se3.rotation_about(0.5 * se3.log_rotation(step[:3, :3]))
    half_way = se3.about(centre, half_turn, 0.5 * (se3.apply(step, centre[None])[0] - centre))
    own, other, between = (
        closeness(views.fine, T) for T in (T_target_source, copy, half_way @ T_target_source)
    )
    return other > own - _VALLEY and min(own, other) > between + _VALLEY


def _shifted(points: MovedPoints, reach: int) -> list[Array]:
    # Shifted along the commonest surface and turned on it, the fullest first.
    turns = [se3.rotation_about(np.radians(deg) * points.axes[0]) for deg in _TURNS_DEG]
    middle, frame = points.things[points.axis > 0].mean(axis=0), points.upright
    share = points.share((1, 2), frame, middle, turns, (reach, reach))
    return [
        se3.about(middle, turns[turn], points.cell * np.array([i - reach, j - reach, 0]) @ frame)
        for turn, i, j in peaks(share, _WINDOW, _SHARE)
    ]


def _raised(points: MovedPoints, reach: int) -> list[Array]:
    # Away from the commonest surface, whose points alone count: what faces the others meets there anyway.
    frame, middle = points.axes[[1, 0, 2]], points.things.mean(axis=0)
    share = points.share((0,), frame, middle, [np.eye(3)], (0, reach))
    return [
        se3.from_rt(np.eye(3), points.cell * (j - reach) * points.axes[0])
        for _, _, j in peaks(share, _WINDOW, _SHARE)
    ]
