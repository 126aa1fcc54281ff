# SPDX-License-Identifier: MIT
"""Repeated structure near a pose: rows, racks, ribs, floors, and maps that hold a place twice."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.things import GROUND, things
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
# The same share where the pose lets both clouds be seen from one place, and more coincides than at any other; by hand.
_SHARE_OF_ONE_PLACE = 0.1
# Copies of each kind returned, at most; by hand.
_MOST = 4
# Cells, or turns, between two of them, at least; by hand.
_APART = 2
# The same of turns about a thing: when its near side has turned away, little of it is left; by hand.
_OF_ROUND = 0.2
# Share of a thing's points that are no stray returns, at least; by hand.
_NOT_STRAY = 0.98
# Cells over the ground from which a point belongs to a thing, and cells between two; by hand.
_OFF_GROUND, _GAP = 1.5, 2.0
# Steps to the middle of a circle: half a per cent of its radius remains.
_STEPS = 200
# Directions whose outermost points make the circle, which they leave by a thousandth of its radius; by hand.
_DIRECTIONS = 72
# Fewest points that coincide at the pose itself, for a turn to be looked for; by hand.
_AT_POSE = 10.0


def copies(views: Views, T_target_source: Array, axes: Array) -> list[Array]:
    """Poses (4, 4) beside a pose, at which nearly as many points coincide: shifted along the commonest surface or away
    from it, or turned about a place where either cloud was seen from, the origin of its frame, or a thing that may be
    round.

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
        self.up = views.vertical(axes)
        self.least = _SHARE_OF_ONE_PLACE if views.from_one_place(T) else _SHARE
        self.round = [*_standing(self.others, self.other_axis == 0, self.up, self.cell)]
        # A thing alone, seen from outside, whose largest face passes for a ground.
        centre, radius = _circle(self.others, self.up, self.cell)
        if np.linalg.norm(views.target.centre - centre) > radius:
            self.round.append((centre, radius))

    def shifted(self) -> Iterator[Array]:
        middle = self.things[self.axis > 0].mean(axis=0)
        frame = self.upright
        reach = (_ACROSS, _ALONG)
        turns = [se3.rotation_about(np.radians(deg) * self.axes[0]) for deg in _TURNS_DEG]
        share = self.share((1, 2), frame, middle, turns, reach)
        best, turn = share.max(axis=0), share.argmax(axis=0)
        for i, j in _peaks(best, self.least):
            shift = self.cell * np.array([i - reach[0], j - reach[1], 0]) @ frame
            yield se3.about(middle, turns[turn[i, j]], shift)

    def raised(self) -> Iterator[Array]:
        middle = self.things.mean(axis=0)
        share = self.share((0, 1, 2), self.axes[[1, 0, 2]], middle, [np.eye(3)], (0, _ALONG))[0]
        for _, j in _peaks(share, self.least):
            yield se3.from_rt(np.eye(3), self.cell * (j - _ALONG) * self.axes[0])

    def turned(self) -> Iterator[Array]:
        others = OccupiedCells(self.others[self.other_axis > 0], self.cell)
        own = self.things[self.axis > 0]
        for centre in self.centres:
            yield from self._about(centre, own[: _POINTS // 3], others, _OF_ALL)
        for centre, radius in self.round:
            arms = own - centre
            within = np.linalg.norm(arms - np.outer(arms @ self.up, self.up), axis=1) < radius
            yield from self._about(centre, own[within], others, _OF_ROUND)

    def _about(self, centre: Array, own: Array, others: OccupiedCells, least: float) -> Iterator[Array]:
        degrees = np.concatenate([[0.0], np.arange(_FIRST_DEG, 360.0 - _FIRST_DEG, _ROUND_DEG)])
        turns = se3.rotation_about(np.radians(degrees)[:, None] * self.up)
        moved = (own - centre) @ np.swapaxes(turns, 1, 2) + centre
        met = CHANCE + others.hold(moved).sum(axis=1)
        if met[0] < CHANCE + _AT_POSE:  # nothing coincides at the pose itself
            return
        share = np.where(met >= least * met[0], met / met[0], 0.0)
        share[0] = 0.0
        for _, k in _peaks(share[None], _SHARE, centre=False):
            yield se3.about(centre, turns[k], np.zeros(3))


def _standing(
    points: Array, ground: NDArray[np.bool_], up: Array, cell: float
) -> Iterator[tuple[Array, float]]:
    # Centre and radius of what may be round, like a gear or a wheel: most of what stands on the ground, or the table.
    if not ground.any():
        return
    places = points @ se3.turn_to_z(up).T
    heights = np.abs(places[:, 2] - np.median(places[ground, 2]))
    thing = things(places[:, :2], heights, _OFF_GROUND * cell, _GAP * cell)
    counts = np.bincount(thing)
    counts[GROUND] = 0
    if counts.max() > counts.sum() / 2:
        yield _circle(points[thing == counts.argmax()], up, cell)


def _circle(points: Array, up: Array, cell: float) -> tuple[Array, float]:
    # Centre and radius of the circle around points, seen along `up`.
    frame = se3.turn_to_z(up)
    places = points @ frame.T
    from_median = np.linalg.norm(places[:, :2] - np.median(places[:, :2], axis=0), axis=1)
    middle, radius = _enclosing(places[from_median <= np.quantile(from_median, _NOT_STRAY), :2])
    return np.array([*middle, places[:, 2].mean()]) @ frame, radius + cell


def _enclosing(places: Array) -> tuple[Array, float]:
    # Middle and radius of the smallest circle around places (n, 2), nearly: by ever shorter steps to the farthest, from
    # the outermost ones' middle. The others do not count.
    directions = np.linspace(0.0, 2.0 * np.pi, _DIRECTIONS, endpoint=False)
    outermost = np.argmax(places @ np.array([np.cos(directions), np.sin(directions)]), axis=0)
    places = places[np.unique(outermost)]
    middle = places.mean(axis=0)
    for step in range(1, _STEPS):
        middle = middle + (places[_farthest(places, middle)] - middle) / (step + 1)
    return middle, float(np.linalg.norm(places[_farthest(places, middle)] - middle))


def _farthest(places: Array, middle: Array) -> int:
    return int(np.argmax(np.sum((places - middle) ** 2, axis=1)))


def _apart(places: Sequence[Array], least: float) -> list[Array]:
    kept: list[Array] = []
    for place in places:
        if all(np.linalg.norm(place - other) > least for other in kept):
            kept.append(place)
    return kept


def _peaks(share: Array, least: float, *, centre: bool = True) -> list[tuple[int, int]]:
    # The fullest; without the pose itself, where it is at the centre.
    middle = np.array(share.shape) // 2
    found = [
        (i, j)
        for i, j in peaks(share, 2 * _APART + 1, least)
        if not centre or max(abs(i - middle[0]), abs(j - middle[1])) > _APART
    ]
    return found[:_MOST]
