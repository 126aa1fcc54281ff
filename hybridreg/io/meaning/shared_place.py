# SPDX-License-Identifier: MIT
"""One place at which many points of a cloud lie: missing returns that were moved with the others, or padding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.meaning.first_column import looked_at

Array = NDArray[np.float64]

_FEWEST = 10  # of the points looked at


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
