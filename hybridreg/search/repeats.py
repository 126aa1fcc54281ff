# SPDX-License-Identifier: MIT
"""Repeated structure near a pose: rows, racks, ribs, and maps that hold a place twice."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.geometry.main_axes import faced

Array = NDArray[np.float64]

# Edge of a cell, spacings; by hand.
_CELL = 1.0
# Farthest shifts, spacings: along the commoner of the two axes, up to 10 m outdoors, a metre in a room, and along the
# rarer, where a corridor repeats, as far as most of a cloud reaches (`hybridreg.resolution`); by hand.
_ACROSS, _ALONG = 20.0, 60.0
# Rotations tried with each shift, degrees; by hand.
_TURNS_DEG = (-3.0, -1.5, 0.0, 1.5, 3.0)
# Points that are shifted: for speed.
_POINTS = 400
# Share of the points that coincide at the pose which must coincide elsewhere; by hand.
_SHARE = 0.25
# Shifts returned, at most; by hand.
_MOST = 4
# Cells between two of them, at least; by hand.
_APART = 2
# Fewest points that identify a place; by hand.
_FEWEST = 20
# Points of either axis that coincide by chance, added to every count; by hand.
_CHANCE = 10.0


def copies(views: Views, T_target_source: Array, axes: Array) -> list[Array]:
    """Poses (4, 4) beside a pose, shifted along the commonest surface, at which nearly as many points coincide.

    Points that face the commonest axis `axes[0]` coincide anywhere (on a street, those of its ground), and do not
    count. Of those that face the other two the same share must coincide each: along a corridor the floor does anyway.
    Two points coincide in one cell of a grid.
    """
    source, target, spacing = views.source, views.target, views.spacing
    frame = np.vstack([axes[1:], axes[:1]])  # the commonest direction last
    cell = _CELL * spacing
    reach = (round(_ACROSS / _CELL), round(_ALONG / _CELL))
    axis = faced(source.normals[source.settling] @ T_target_source[:3, :3].T, axes)
    rows, axis = source.settling[axis > 0][:_POINTS], axis[axis > 0][:_POINTS]
    other = faced(target.normals, axes)
    if len(rows) < _FEWEST or np.count_nonzero(other > 0) < _FEWEST:
        return []
    things = se3.apply(T_target_source, source.points[rows])
    middle = things.mean(axis=0)
    arms = things - middle
    farthest = np.linalg.norm(arms, axis=1).max() + 2 * max(reach) * cell
    turns = [arms @ se3.rotation_about(np.radians(deg) * axes[0]).T @ frame.T for deg in _TURNS_DEG]
    share = np.full((len(turns), 2 * reach[0] + 1, 2 * reach[1] + 1), np.inf)
    for facing in (1, 2):
        held = (target.points[other == facing] - middle) @ frame.T
        held = held[np.abs(held).max(axis=1) < farthest]
        if len(held) == 0:
            continue
        cells = _Cells(held, cell)
        met = _CHANCE + np.stack([cells.met(turned[axis == facing], reach) for turned in turns])
        np.minimum(share, met / met[:, reach[0], reach[1]].max(), out=share)
    best, turn = share.max(axis=0), share.argmax(axis=0)
    poses = []
    for i, j in _peaks(best):
        shift = cell * np.array([i - reach[0], j - reach[1], 0]) @ frame
        turned = se3.rotation_about(np.radians(_TURNS_DEG[turn[i, j]]) * axes[0])
        poses.append(se3.about(middle, turned, shift) @ T_target_source)
    return poses


def _peaks(share: Array) -> list[tuple[int, int]]:
    # Shifts at which no less coincides than at those around, the best first, without the pose itself in the middle.
    from scipy.ndimage import maximum_filter

    i, j = (n // 2 for n in share.shape)
    peak = (share == maximum_filter(share, 2 * _APART + 1, mode="constant")) & (share >= _SHARE)
    peak[i - _APART : i + _APART + 1, j - _APART : j + _APART + 1] = False
    rows, columns = np.nonzero(peak)
    order = np.argsort(-share[rows, columns], kind="stable")[:_MOST]
    return list(zip(rows[order].tolist(), columns[order].tolist(), strict=True))


class _Cells:
    # The cells (C, 3) that hold a point, sorted by their keys: a full grid of a sparse cloud would take gigabytes.

    def __init__(self, points: Array, cell: float) -> None:
        cells = np.floor(points / cell).astype(np.int64)
        self._cell, self._origin = cell, cells.min(axis=0)
        self._size = cells.max(axis=0) - self._origin + 1
        self._keys = np.unique(self._key((cells - self._origin).T))

    def _key(self, cells: NDArray[np.int64]) -> NDArray[np.int64]:
        i, j, k = cells
        return (k * self._size[0] + i) * self._size[1] + j

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
