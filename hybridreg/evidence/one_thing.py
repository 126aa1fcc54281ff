# SPDX-License-Identifier: MIT
"""Does one thing alone hold the pose along some direction, while the rest contradicts it?

A trolley that moved between two scans, and fills much of the view, draws the pose after it: the wall behind it and the
floor slide along themselves. What little else faces that way lies elsewhere then.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.agreement import Agreement, compared
from hybridreg.evidence.things import GROUND, things
from hybridreg.evidence.traffic import LEVEL, least_held
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3

Array = NDArray[np.float64]

# Thicknesses of the ground over it from which points belong to a thing, and spacings between two things; by hand.
_OFF_GROUND, _GAP = 3.0, 2.0
# Things that are tried, those of which most agrees; by hand.
_TRIED = 5
# Its extent over that of all things, at most: what fills the place, as walls do, does not move; by hand.
_SMALL = 0.5
# What it holds, points' worth, at least, and share of that which the rest may hold; by hand.
_HOLDS, _REST = 10.0, 0.15
# Points of the rest that contradict it: so many, so much of what it holds, and times as many as agree; by hand. Of 179
# right poses (real, `sim:val`, hard kinds with even seeds) two are told; of eight that follow a moved thing, five.
_FEWEST, _SHARE, _TIMES = 5, 0.1, 3.0


def held_by_one(views: Views, T_target_source: Array, agreement: Agreement) -> Array | None:
    """The level direction (3,) of the target along which one thing alone holds a pose (4, 4), and the rest contradicts
    it; None where there is none, or where a cloud shows no ground."""
    up, ground = views.up, views.target.ground
    if up is None or ground is None:
        return None
    level = ground.levelling[:2]
    points, normals, looked, agrees = compared(views, agreement)
    thing = _things(views, T_target_source)
    upright = looked & (thing != GROUND) & (np.abs(normals @ up) < LEVEL)
    flat, holds = normals @ level.T, upright & agrees
    places = points @ level.T
    most = _SMALL * _extent(places[thing != GROUND]) if holds.any() else 0.0
    each, counts = np.unique(thing[holds], return_counts=True)
    for one in each[np.argsort(-counts)][:_TRIED]:
        its = thing == one
        if _extent(places[its]) > most:
            continue
        along, held, facing = least_held(flat, holds & ~its)
        by_it, by_rest = (held[facing & holds & which].sum() for which in (its, ~its))
        against = np.count_nonzero(facing & upright & ~agrees & ~its)
        beside = np.count_nonzero(facing & holds & ~its)
        alone = by_it >= _HOLDS and by_rest <= _REST * by_it
        if alone and against >= max(_FEWEST, _SHARE * by_it) and against > _TIMES * beside:
            direction: Array = along @ level
            return direction
    return None


def _extent(places: Array) -> float:
    # Length of the box around most places (n, 2), across it.
    return float(np.linalg.norm(np.ptp(np.quantile(places, [0.02, 0.98], axis=0), axis=0)))


def _things(views: Views, T: Array) -> NDArray[np.int64]:
    # Of each compared point, the source's first, the number of its thing among those of both clouds.
    source, target = views.source, views.target
    assert target.ground is not None  # asked before
    points = np.concatenate([se3.apply(T, source.points), target.points])
    thing = things(
        points @ target.ground.levelling[:2].T,
        target.ground.above(points),
        _OFF_GROUND * target.thickness,
        _GAP * views.spacing,
    )
    return thing[np.concatenate([source.asked, len(source.points) + target.asked])]
