# SPDX-License-Identifier: MIT
"""Repeated structure near a pose: rows, racks, ribs, floors, and maps that hold a place twice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.search.moved_points import CHANCE, MovedPoints, peaks
from hybridreg.search.occupied_cells import OccupiedCells

Array = NDArray[np.float64]

# Edge of a cell, spacings; by hand.
_CELL = 1.0
# Farthest shifts, cells: along the commoner of the two axes, up to 10 m outdoors, a metre in a room, and along the
# rarer, where a corridor repeats, as far as most of a cloud reaches (`hybridreg.resolution`); by hand.
_ACROSS, _ALONG = 20, 60
# Rotations tried with each shift, degrees; by hand.
_TURNS_DEG = (-3.0, -1.5, 0.0, 1.5, 3.0)
# Degrees between turns without a shift, and the first of them; by hand.
_ROUND_DEG, _FIRST_DEG = 2.0, 6.0
# Points of each kind that are moved: for speed.
_POINTS = 400
# Share of the points that coincide at the pose which must coincide elsewhere, of either kind, and of all; by hand.
_SHARE, _OF_ALL = 0.25, 0.4
# Copies of each kind returned, at most; by hand.
_MOST = 4
# Cells, or turns, between two of them, at least; by hand.
_APART = 2
# Fewest points that coincide at the pose itself, for a turn to be looked for; by hand.
_AT_POSE = 10.0


def copies(views: Views, T_target_source: Array, axes: Array) -> list[Array]:
    """Poses (4, 4) beside a pose, at which nearly as many points coincide: shifted along the commonest surface or away
    from it, or turned about a place where either cloud was seen from, or the origin of its frame.

    Points that face the commonest axis `axes[0]` coincide anywhere along it (on a street, those of its ground), and
    count only where the shift leads away from it. Of the others the same share must coincide for each axis: along a
    corridor the floor does anyway. Two points coincide in one cell of a grid.
    """
    place = _Place(views, T_target_source, axes)
    if place.tell_nothing:
        return []
    return [M @ T_target_source for M in (*place.shifted(), *place.raised(), *place.turned())]


class _Place(MovedPoints):
    def __init__(self, views: Views, T: Array, axes: Array) -> None:
        super().__init__(views, T, axes, _CELL * views.spacing, _POINTS)
        origin = np.zeros(3)
        own = se3.apply(T, np.array([views.source.centre, origin]))
        self.centres = _apart([*own, views.target.centre, origin], 2.0 * self.cell)
        self.up = axes[0] if views.up is None else views.up

    def shifted(self) -> Iterator[Array]:
        middle = self.things[self.axis > 0].mean(axis=0)
        frame = self.upright
        reach = (_ACROSS, _ALONG)
        turns = [se3.rotation_about(np.radians(deg) * self.axes[0]) for deg in _TURNS_DEG]
        share = self.share((1, 2), frame, middle, turns, reach)
        best, turn = share.max(axis=0), share.argmax(axis=0)
        for i, j in _peaks(best):
            shift = self.cell * np.array([i - reach[0], j - reach[1], 0]) @ frame
            yield se3.about(middle, turns[turn[i, j]], shift)

    def raised(self) -> Iterator[Array]:
        middle = self.things.mean(axis=0)
        share = self.share((0, 1, 2), self.axes[[1, 0, 2]], middle, [np.eye(3)], (0, _ALONG))[0]
        for _, j in _peaks(share):
            yield se3.from_rt(np.eye(3), self.cell * (j - _ALONG) * self.axes[0])

    def turned(self) -> Iterator[Array]:
        degrees = np.concatenate([[0.0], np.arange(_FIRST_DEG, 360.0 - _FIRST_DEG, _ROUND_DEG)])
        turns = se3.rotation_about(np.radians(degrees)[:, None] * self.up)
        things = self.things[self.axis > 0][: _POINTS // 3]
        others = OccupiedCells(self.others[self.other_axis > 0], self.cell)
        for centre in self.centres:
            moved = (things - centre) @ np.swapaxes(turns, 1, 2) + centre
            met = CHANCE + others.hold(moved).sum(axis=1)
            if met[0] < CHANCE + _AT_POSE:  # nothing coincides at the pose itself
                continue
            share = np.where(met >= _OF_ALL * met[0], met / met[0], 0.0)
            share[0] = 0.0
            for _, k in _peaks(share[None], centre=False):
                yield se3.about(centre, turns[k], np.zeros(3))


def _apart(places: Sequence[Array], least: float) -> list[Array]:
    kept: list[Array] = []
    for place in places:
        if all(np.linalg.norm(place - other) > least for other in kept):
            kept.append(place)
    return kept


def _peaks(share: Array, *, centre: bool = True) -> list[tuple[int, int]]:
    # The fullest; without the pose itself, where it is at the centre.
    middle = np.array(share.shape) // 2
    found = [
        (i, j)
        for i, j in peaks(share, 2 * _APART + 1, _SHARE)
        if not centre or max(abs(i - middle[0]), abs(j - middle[1])) > _APART
    ]
    return found[:_MOST]
