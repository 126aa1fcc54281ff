# SPDX-License-Identifier: MIT
"""A first column that rises evenly again and again: the time in each of several sweeps, or along each ring."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FEWEST = 20  # rows of a sweep that are looked at
_STRAIGHT = 0.1  # of its span: a clock's distance from a straight line over its rows, by hand
_MOST = 0.9  # share of the sweeps that must look so; the first and the last may be cut
_ALL = 0.8  # of the column's span, and of the points', that a sweep goes through
_WIDE = 0.5


def rises_again(rows: NDArray[Any], chosen: NDArray[np.int64]) -> bool:
    """Whether the first column of `rows` (N, 3+), seen at the `chosen` ones, rises from one value to another several
    times, while the next two columns go through most of theirs each time.

    They do not in a grid, in slices, or in an organised scan of a wall, where x rises so.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        some = np.asarray(np.ma.filled(rows[chosen, :3].astype(np.float64), np.nan))
    finite = np.isfinite(some).all(axis=1)
    some, chosen = some[finite], chosen[finite]
    first = some[:, 0]
    span = np.ptp(some, axis=0) if len(some) else np.zeros(3)
    # Around its sensor x goes from below to above zero, and a time within a sweep does not.
    if not span.all() or first.min() < 0.0 < first.max():
        return False
    begins = np.flatnonzero(np.diff(first) < 0.0) + 1
    if not 1 <= len(begins) <= len(first) / _FEWEST:
        return False
    sweeps = zip(np.split(some, begins), np.split(chosen, begins), strict=True)
    return bool(np.mean([_is_sweep(*each, span) for each in sweeps]) >= _MOST)


def _is_sweep(points: Array, numbers: NDArray[np.int64], span: Array) -> bool:
    if len(points) < 3:
        return False
    widths = np.ptp(points, axis=0) / span
    if widths[0] < _ALL or (widths[1:] < _WIDE).any():
        return False
    upward = np.mean(np.diff(points[:, 1]) > 0.0)
    if not 0.05 < upward < 0.95:  # an organised scan's y that goes on with its x
        return False
    even = np.interp(numbers, numbers[[0, -1]], points[[0, -1], 0])
    # Rows of text are drawn by chance before they come here, which bends a short line.
    straight = max(_STRAIGHT, 1.5 / np.sqrt(len(points)))
    return bool(np.abs(points[:, 0] - even).max() <= straight * np.ptp(points[:, 0]))
