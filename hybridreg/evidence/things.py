# SPDX-License-Identifier: MIT
"""Things that stand on the ground, told apart by the gaps between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# What a point is part of that no thing holds.
GROUND = 0
# Cells along an axis, at most: for memory.
_MOST_CELLS = 2_000


def things(places: Array, heights: Array, off_ground: float, gap: float) -> Rows:
    """Of each point (n,) the number from 1 on of the thing which it is part of, else `GROUND`.

    Parameters
    ----------
    places : (n, 2)
        Level coordinates of the points, metres.
    heights : (n,)
        Metres over the ground.
    off_ground : float
        Height from which points belong to a thing, metres.
    gap : float
        Metres, seen from above, between two things.
    """
    from scipy import ndimage

    thing = np.full(len(places), GROUND)
    rows = np.flatnonzero(heights > off_ground)
    if len(rows) == 0:
        return thing
    offsets = places[rows] - places[rows].min(axis=0)
    cells = (offsets / max(gap, float(offsets.max()) / _MOST_CELLS)).astype(np.int64)
    grid = np.zeros(cells.max(axis=0) + 1, dtype=bool)
    grid[tuple(cells.T)] = True
    thing[rows] = ndimage.label(grid, np.ones((3, 3)))[0][tuple(cells.T)]
    return thing
