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
# Farthest shift, spacings: up to 10 m outdoors, a metre in a room; by hand.
_FARTHEST = 20.0
# Rotations tried with each shift, degrees; by hand.
_TURNS_DEG = (-3.0, -1.5, 0.0, 1.5, 3.0)
# Points that are shifted: for speed.
_POINTS = 400
# Share of the points that coincide at the pose which must coincide elsewhere; by hand.
_SHARE = 0.4
# Shifts returned, at most; by hand.
_MOST = 4
# Cells between two of them, at least; by hand.
_APART = 2
# Fewest points that identify a place; by hand.
_FEWEST = 20


def copies(views: Views, T_target_source: Array, axes: Array) -> list[Array]:
    """Poses (4, 4) beside a pose, shifted along the commonest surface, at which nearly as many points coincide.

    Only points that do not face the commonest axis `axes[0]` count (on a street, all but its ground); two points
    coincide in one cell of a grid.
    """
    source, target, spacing = views.source, views.target, views.spacing
    frame = np.vstack([axes[1:], axes[:1]])  # the commonest direction last
    cell = _CELL * spacing
    rows = source.settling[faced(source.normals[source.settling] @ T_target_source[:3, :3].T, axes) > 0]
    things = se3.apply(T_target_source, source.points[rows[:_POINTS]])
    other = target.points[faced(target.normals, axes) > 0]
    if len(things) < _FEWEST or len(other) < _FEWEST:
        return []
    middle = things.mean(axis=0)
    reach = round(_FARTHEST / _CELL)
    arms, others = things - middle, (other - middle) @ frame.T
    near = np.abs(others).max(axis=1) < np.linalg.norm(arms, axis=1).max() + 2 * reach * cell
    if not near.any():
        return []
    held = _Cells(others[near], cell)
    met = np.stack([held.met(_turned(arms, axes[0], deg) @ frame.T, reach) for deg in _TURNS_DEG])
    best, turn = met.max(axis=0), met.argmax(axis=0)
    peaks = _peaks(best, max(_SHARE * best[reach, reach], 0.5 * _FEWEST))
    poses = []
    for i, j in peaks:
        shift = cell * np.array([i - reach, j - reach, 0]) @ frame
        turned = se3.rotation_about(np.radians(_TURNS_DEG[turn[i, j]]) * axes[0])
        poses.append(se3.about(middle, turned, shift) @ T_target_source)
    return poses


def _peaks(met: NDArray[np.int64], least: float) -> list[tuple[int, int]]:
    # Cells that hold no less than those around, the fullest first, without the pose itself in the middle.
    from scipy.ndimage import maximum_filter

    middle = len(met) // 2
    peak = (met == maximum_filter(met, 2 * _APART + 1, mode="constant")) & (met >= least)
    peak[middle - _APART : middle + _APART + 1, middle - _APART : middle + _APART + 1] = False
    i, j = np.nonzero(peak)
    order = np.argsort(-met[i, j], kind="stable")[:_MOST]
    return list(zip(i[order].tolist(), j[order].tolist(), strict=True))


def _turned(arms: Array, axis: Array, degrees: float) -> Array:
    return arms @ se3.rotation_about(np.radians(degrees) * axis).T


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

    def met(self, points: Array, reach: int) -> NDArray[np.int64]:
        """How many of the points (n, 3) fall into these cells under each shift: (2 reach + 1, 2 reach + 1)."""
        across, along, height = (np.floor(points / self._cell).astype(np.int64) - self._origin).T
        shift = np.arange(-reach, reach + 1)
        # Cells of one row follow one another among the keys: one stretch for each point and shift across.
        moved = across[:, None] + shift
        point, nth = np.nonzero(
            (moved >= 0) & (moved < self._size[0]) & ((height >= 0) & (height < self._size[2]))[:, None]
        )
        i, j, k = moved[point, nth], along[point], height[point]
        lowest, highest = np.maximum(j - reach, 0), np.minimum(j + reach, self._size[1] - 1)
        start = np.searchsorted(self._keys, self._key(np.array([i, lowest, k])))
        end = np.searchsorted(self._keys, self._key(np.array([i, highest, k])), side="right")
        many = np.where(lowest <= highest, end - start, 0)
        at = np.repeat(start - (np.cumsum(many) - many), many) + np.arange(many.sum())
        column = self._keys[at] % self._size[1] - np.repeat(j, many) + reach
        side = 2 * reach + 1
        return np.bincount(np.repeat(nth, many) * side + column, minlength=side * side).reshape(side, side)
