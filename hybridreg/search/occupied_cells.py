# SPDX-License-Identifier: MIT
"""Which cells of a grid hold a point, and how many points fall into such cells under every shift."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.voxel_cells import distinct_keys

Array = NDArray[np.float64]


class OccupiedCells:
    """The cells of a grid that hold a point, sorted by their keys: a full grid of a sparse cloud would take gigabytes.

    Parameters
    ----------
    points : (n, 3), at least one
    cell : float
        Edge of a cell, metres.
    """

    def __init__(self, points: Array, cell: float) -> None:
        cells = np.floor(points / cell).astype(np.int64)
        self._cell, self._origin = cell, cells.min(axis=0)
        self._size = cells.max(axis=0) - self._origin + 1
        self._keys = distinct_keys(self._key((cells - self._origin).T))

    def _key(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        i, j, k = cells
        return (k * self._size[0] + i) * self._size[1] + j

    def hold(self, points: Array) -> NDArray[np.bool_]:
        """Which of the points (..., 3) fall into these cells, (...)."""
        cells = np.moveaxis(np.floor(points / self._cell).astype(np.int64) - self._origin, -1, 0)
        inside = ((cells >= 0) & (cells < self._size.reshape(3, *np.ones(points.ndim - 1, dtype=int)))).all(
            axis=0
        )
        key = self._key(np.where(inside, cells, 0))
        at = np.minimum(np.searchsorted(self._keys, key), len(self._keys) - 1)
        held: NDArray[np.bool_] = inside & (self._keys[at] == key)
        return held

    def met(self, points: Array, reach: tuple[int, int]) -> NDArray[np.int64]:
        """How many of the points (n, 3) fall into these cells under each shift of up to so many rows and columns."""
        across, along, height = (np.floor(points / self._cell).astype(np.int64) - self._origin).T
        rows, columns = reach
        shift = np.arange(-rows, rows + 1)
        # Cells of one row follow one another among the keys: one stretch for each point and shift across.
        moved = across[:, None] + shift
        point, nth = np.nonzero(
            (moved >= 0) & (moved < self._size[0]) & ((height >= 0) & (height < self._size[2]))[:, None]
        )
        i, j, k = moved[point, nth], along[point], height[point]
        lowest, highest = np.maximum(j - columns, 0), np.minimum(j + columns, self._size[1] - 1)
        start = np.searchsorted(self._keys, self._key(np.array([i, lowest, k])))
        end = np.searchsorted(self._keys, self._key(np.array([i, highest, k])), side="right")
        many = np.where(lowest <= highest, end - start, 0)
        at = np.repeat(start - (np.cumsum(many) - many), many) + np.arange(many.sum())
        column = self._keys[at] % self._size[1] - np.repeat(j, many) + columns
        shape = (2 * rows + 1, 2 * columns + 1)
        return np.bincount(np.repeat(nth, many) * shape[1] + column, minlength=shape[0] * shape[1]).reshape(
            shape
        )
