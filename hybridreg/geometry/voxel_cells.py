# SPDX-License-Identifier: MIT
"""Cells of a voxel grid and the centroids of the points in them, for any number of points in little memory."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.extent import lone

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_MOST_CELLS = 2**62
# Points sorted at once: more would not be faster, and sorting takes seven times their memory.
_LOT = 2**20
# Cells of several batches from which these are merged before the next batch.
_KEPT = 4 * _LOT


class Cells(NamedTuple):
    """Occupied cells, ordered: x first, then y, then z.

    centroids : (n, 3) float64
    first : (n,) int64, row of one point in each
    """

    centroids: Array
    first: Integers


class _Lot(NamedTuple):
    key: Integers  # (n,) of the occupied cells, rising
    counts: Integers  # (n,) points in each
    sums: Array  # (3, n) of their coordinates
    first: Integers  # (n,) row of the first of them


def voxel_centroids(points: Array, voxel: float, name: str = "cloud") -> Array:
    """Centroids (n, 3) of the occupied cells of a grid, ordered by cell.

    Parameters
    ----------
    points : (N, 3)
    voxel : float
        Edge of a cell, metres.
    name : str
        What an error calls the points.

    Raises
    ------
    ValueError
        If the grid has more cells than an index can represent.
    """
    return voxel_cells(points, voxel, name).centroids


def voxel_cells(points: Array, voxel: float, name: str = "cloud") -> Cells:
    """The occupied cells of a grid with edges of `voxel` metres; as `voxel_centroids`."""
    # The origin lies slightly below the smallest coordinate: data rounded to millimetres would otherwise lie on cell
    # borders, where the last digit of a float decides.
    low, high = _corners(points)
    origin = low - 1e-5 * voxel
    shape = np.floor((high - origin) / voxel) + 1.0
    if math.prod(shape.tolist()) > _MOST_CELLS:
        far = lone(points)
        cure = f"{far}, remove them" if far else "choose a larger voxel or check the unit"
        cells = " x ".join(f"{s:.3g}" for s in shape)
        raise ValueError(f"{name}: a voxel of {voxel:.3g} m cuts it into {cells} cells; {cure}")
    nx, ny, nz = (int(s) for s in shape)
    lots: list[_Lot] = []
    most = _KEPT
    for start in range(0, len(points), _LOT):
        columns = np.ascontiguousarray(
            points[start : start + _LOT].T
        )  # (3, m): numpy reduces along rows faster
        x, y, z = ((columns - origin[:, None]) / voxel).astype(np.int64)
        lots.append(_lot(columns, x + nx * (y + ny * z), nx * ny * nz, start))
        if sum(len(lot.key) for lot in lots) > most:
            lots = [_merged(lots)]
            most = max(_KEPT, 2 * len(lots[0].key))
    whole = lots[0] if len(lots) == 1 else _merged(lots)
    return Cells(np.ascontiguousarray(whole.sums.T) / whole.counts[:, None], whole.first)


def distinct_keys(keys: Integers) -> Integers:
    """The different ones among keys (n,), rising: sorted, as `np.unique` of numpy 2.3 and later hashes them first and
    takes ten times as long."""
    rising = np.sort(keys)
    first = np.ones(len(rising), dtype=np.bool_)
    first[1:] = rising[1:] != rising[:-1]
    return rising[first]


def _corners(points: Array) -> tuple[Array, Array]:
    lots = (np.ascontiguousarray(points[start : start + _LOT].T) for start in range(0, len(points), _LOT))
    low, high = zip(*((rows.min(axis=1), rows.max(axis=1)) for rows in lots), strict=True)
    return np.min(low, axis=0), np.max(high, axis=0)


def _lot(columns: Array, key: Integers, n_cells: int, start: int) -> _Lot:
    member, cells, first = _members(key, n_cells)
    sums = np.array([np.bincount(member, weights=column, minlength=len(cells)) for column in columns])
    return _Lot(cells, np.bincount(member, minlength=len(cells)), sums, first + start)


def _members(key: Integers, n_cells: int) -> tuple[Integers, Integers, Integers]:
    """Rank of each point's cell among the occupied ones, the keys of those, and the row of a point in each."""
    bits = len(key).bit_length()
    if n_cells >= 2 ** (63 - bits):
        cells, first, member = np.unique(key, return_index=True, return_inverse=True)
        return member, cells, first
    # Cell and row in one number, because numpy sorts numbers several times faster than it finds their order.
    both = np.sort((key << bits) | np.arange(len(key)))
    cell, row = both >> bits, both & ((1 << bits) - 1)
    begins = np.concatenate([[True], cell[1:] != cell[:-1]])
    member = np.empty(len(key), dtype=np.int64)
    member[row] = np.cumsum(begins) - 1
    return member, cell[begins], row[begins]


def _merged(lots: list[_Lot]) -> _Lot:
    # The same cells of several batches, one after another: a stable order keeps the first row first.
    key = np.concatenate([lot.key for lot in lots])
    order = np.argsort(key, kind="stable")
    key = key[order]
    begins = np.flatnonzero(np.concatenate([[True], key[1:] != key[:-1]]))
    counts = np.add.reduceat(np.concatenate([lot.counts for lot in lots])[order], begins)
    sums = np.add.reduceat(np.concatenate([lot.sums for lot in lots], axis=1)[:, order], begins, axis=1)
    return _Lot(key[begins], counts, sums, np.concatenate([lot.first for lot in lots])[order][begins])
