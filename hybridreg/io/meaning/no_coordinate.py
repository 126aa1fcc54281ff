# SPDX-License-Identifier: MIT
"""A column of three that is no coordinate: the number of a ring, an intensity, a label, or another column once more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LOOKED_AT = 5_000  # points
_FEWEST = 100  # points that tell
_MOST = 255.0  # the largest number of a ring, and of most intensities
_WHOLE = 0.05  # share of whole numbers, at most, among real coordinates
_SAME = 0.99  # share of the points in which one column repeats another


def no_coordinate(points: Array) -> str | None:
    """What is wrong with a column of points (N, 3), in words, with the cure; None where nothing is.

    Depths in whole millimetres lie beyond 255, and points on a grid have whole numbers in other columns too.
    """
    some = points[:: max(1, len(points) // _LOOKED_AT)]
    if len(some) < _FEWEST:
        return None
    for one, other in ((0, 1), (0, 2), (1, 2)):
        same = some[:, one] == some[:, other]
        if np.mean(same) > _SAME and np.ptp(some[:, one]) > 0.0:
            return f"its {'xyz'[one]} and its {'xyz'[other]} are the same: give three different columns"
    with np.errstate(invalid="ignore"):
        whole = (some == np.round(some)).mean(axis=0)
    for k in range(3):
        column, others = some[:, k], np.delete(whole, k)
        counted = whole[k] == 1.0 and column.min() >= 0.0 and 1.0 < column.max() <= _MOST
        if counted and others.max() < _WHOLE:
            return (
                f"its {'xyz'[k]} are whole numbers from {column.min():g} to {column.max():g}, and its other "
                "coordinates are not: are they the numbers of rings, intensities or labels? Give the columns x, y and z"
            )
    return None
