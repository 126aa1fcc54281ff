# SPDX-License-Identifier: MIT
"""Does anything hold the pose along the road but vehicles?

Where traffic moves as one stream and nothing else faces along the road, a pose that follows the traffic lets nearly all
points agree: posts are few, rails and noise barriers slide along themselves. The true pose lays hardly any vehicle on
another. Nothing tells which of the two it is.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.agreement import Agreement, in_target
from hybridreg.evidence.things import GROUND, things
from hybridreg.evidence.views import View, Views

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# What may drive off, metres, by hand: no longer (vehicles that follow closely look like one), no wider, no taller; what
# is shorter, and tall, is a post or a tree.
_LONG, _WIDE, _TALL = 25.0, 3.2, 4.5
_SHORT, _LOW = 0.8, 2.0
# A cloud in which nothing is taller was cropped by height, and does not show how tall things are: metres; by hand.
_CROPPED = 2.0
_OFF_GROUND = 0.3  # metres over the ground from which points belong to a thing; by hand
_CELL = 0.4  # metres between two things that are told apart; by hand
LEVEL = 0.6  # sine of the angle between an upright surface's normal and the level, at most; by hand
_FACING = 0.5  # cosine of the angle between a normal and the direction that it holds, at least; by hand
# What fixed things hold of the pose along some direction, beside what vehicles hold: of 24 made poses that follow
# traffic less than 0.01, of 100 right ones, real and of `sim:val`, 0.3 at least where vehicles hold any.
_SHARE = 0.1
# Points of fixed things that hold it, at least: so few agree by chance; by hand.
_FEW = 20.0
# Points of vehicles that hold it, and vehicles, at least; by hand.
_POINTS, _VEHICLES = 40, 3
# Metres along the road over which they are spread, at least: in a room walls are no larger than lorries; by hand.
_SPREAD = 12.0
# Nats from which the ground's relief holds the pose by itself, by hand: real roads have some hundreds at the right one,
# made relief that repeats every nine metres had 77 and 132 at wrong ones.
_TELLS = 100.0

# A point of what cannot drive off, in the place of a thing's number.
_FIXED = -1


def held_along(views: Views, agreement: Agreement) -> Array | None:
    """The level direction (3,) of the target along which vehicles alone hold the pose; None where fixed things do too,
    or the ground's relief does, or either cloud shows no ground."""
    up = views.up
    if up is None or agreement.relief.information > _TELLS:
        return None
    rows = []
    for view, way, points, facing in in_target(views, agreement):
        after = len(views.source.points) if view is views.target else 0
        thing = views.scene.shared(("things", after > 0), partial(_things, view))[view.asked]
        holds = way.looked & way.agrees & (thing != GROUND) & (np.abs(facing @ up) < LEVEL)
        rows.append((points[holds], facing[holds], np.where(thing > 0, thing + after, _FIXED)[holds]))
    points, facing, thing = (np.concatenate(parts) for parts in zip(*rows, strict=True))
    still = thing == _FIXED
    level = views.target.ground.levelling[:2]  # type: ignore[union-attr]
    flat = facing @ level.T
    along, held, holds = least_held(flat, still)
    fixed, moving = held[holds & still].sum(), held[holds & ~still].sum()
    if moving < _POINTS or fixed > min(_SHARE * moving, _FEW):
        return None
    vehicles, places = np.unique(thing[holds & ~still]), points[holds & ~still] @ level.T @ along
    many = len(vehicles) >= 2 * _VEHICLES and np.ptp(places) > _SPREAD  # each is seen by both sensors
    return along @ level if many else None


def least_held(flat: Array, by: NDArray[np.bool_]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """The level direction (2,) that those of some normals (n, 2) which `by` (n,) marks hold least, how much each of all
    holds of it (n,), and which hold it (n,)."""
    along: Array = np.linalg.eigh(flat[by].T @ flat[by])[1][:, 0]
    held = (flat @ along) ** 2
    return along, held, held > _FACING**2


def _things(view: View) -> Rows:
    # Of each point: a number from 1 for the thing that may drive off which it is part of, or one of the two above.
    assert view.ground is not None  # asked before
    height, places = view.ground.above(view.points), view.points @ view.ground.levelling[:2].T
    thing = things(places, height, _OFF_GROUND, _CELL)
    rows = np.flatnonzero(thing != GROUND)
    rows = rows[np.argsort(thing[rows], kind="stable")]
    if len(rows) == 0:
        return thing
    if height[rows].max() < _CROPPED:
        return np.where(thing == GROUND, GROUND, _FIXED)
    label = thing[rows]
    drives = _may_drive(places[rows], height[rows], np.searchsorted(label, np.arange(1, label[-1] + 1)))
    thing[rows] = np.where(drives[label - 1], label, _FIXED)
    return thing


def _may_drive(places: Array, heights: Array, starts: Rows) -> NDArray[np.bool_]:
    # Whether each thing may, by its extent along its own axes; places (n, 2) thing after thing, from `starts` (k,) on.
    counts = np.diff(np.append(starts, len(places)))
    centred = places - np.repeat(np.add.reduceat(places, starts) / counts[:, None], counts, axis=0)
    spread = np.add.reduceat(centred[:, :, None] * centred[:, None, :], starts)
    along = np.einsum("ni,nij->nj", centred, np.repeat(np.linalg.eigh(spread)[1], counts, axis=0))
    wide, long = (np.maximum.reduceat(along, starts) - np.minimum.reduceat(along, starts)).T
    top = np.maximum.reduceat(heights, starts)
    post = (long < _SHORT) & (top > _LOW)
    return np.asarray((long < _LONG) & (wide < _WIDE) & (top < _TALL) & ~post)
