# SPDX-License-Identifier: MIT
"""Places at which many points of a cloud lie: missing returns that were moved with the others, or padding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.meaning.first_column import looked_at

Array = NDArray[np.float64]

_FEWEST = 10  # of the points looked at
_LEAST = 0.01  # share of points that share their places
_SEVERAL = 4  # points at one place, by hand
_NEARLY = 0.9  # share of them that share it with so many: of rounded coordinates most share it with one other


def shared_place(points: Array) -> Array | None:
    """The place, not the origin, that most of some points (N, 3) have to the last bit; None where few share one.

    Drivers write zeros for missing returns, and a pose takes all of them to one place: the sensor's.
    """
    some = points[looked_at(len(points))]
    some = some[some.any(axis=1)]
    if len(some) < _FEWEST:
        return None
    x = np.sort(some[:, 0])
    if not (x[_FEWEST - 1 :] == x[: len(x) - _FEWEST + 1]).any():  # quicker than whole rows
        return None
    places, counts = np.unique(some, axis=0, return_counts=True)
    most = int(counts.argmax())
    return np.asarray(places[most]) if counts[most] >= _FEWEST else None


def shared_places(points: Array) -> NDArray[np.bool_] | None:
    """Which of some points (N, 3) lie where several others do to the last bit; None unless nearly all that
    share a place share it with three and more, and at least one in a hundred points does.

    So lie missing returns of a sensor that moved (`dewarp` of ouster-sdk 1.0.1): those of each column of a scan where
    it stood then, on a line. Rounded coordinates share places too, but on a grid, and mostly two and two.
    """
    some = points[looked_at(len(points))]
    if np.count_nonzero(_shared_by(some) > 1) < _LEAST / 2 * len(some):
        return None
    counts = _shared_by(points)
    counts[counts >= _LEAST * len(points)] = 0  # at one place, which `shared_place` finds
    there = counts >= _SEVERAL
    if np.count_nonzero(there) < _LEAST * len(points) or there.all():
        return None
    if np.count_nonzero(there) < _NEARLY * np.count_nonzero(counts > 1):
        return None
    places = np.unique(points[there], axis=0)
    along = max(len(np.unique(column)) for column in places.T)
    return there if len(places) > 1 and along >= _NEARLY * len(places) else None


def _shared_by(points: Array) -> NDArray[np.int64]:
    """How many points (N, 3) lie exactly where each does."""
    order = np.lexsort(points.T)
    new = np.r_[True, (np.diff(points[order], axis=0) != 0.0).any(axis=1)]
    place = np.cumsum(new) - 1
    counts = np.empty(len(points), dtype=np.int64)
    counts[order] = np.bincount(place)[place]
    return counts
