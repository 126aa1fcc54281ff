# SPDX-License-Identifier: MIT
"""A stack of clouds in one array, as batches for networks are, where an organised scan has the same shape."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LOOKED_AT = 2_000  # points
_FEWEST = 100  # of them, that were seen
_AS_AT_RANDOM = 0.7  # of the distance of two points drawn from a row: a scan's neighbours are closer, by hand


def tell_stack(array: NDArray[Any], name: str) -> None:
    """Warn where neighbours in an array (H, W, 3+) lie as far apart as any two points of a row, and of a column.

    In a scan one of the two is the next place that a beam or a pixel saw; the points of a batch come in any order.
    """
    height, width = array.shape[:2]
    rng = np.random.default_rng(0)
    i, k = rng.integers(0, height - 1, _LOOKED_AT), rng.integers(0, width - 1, _LOOKED_AT)
    here = _points(array[i, k])
    steps = [_apart(here, _points(array[i, k + 1])), _apart(here, _points(array[i + 1, k]))]
    in_row = _apart(here, _points(array[i, rng.integers(0, width, _LOOKED_AT)]))
    in_column = _apart(here, _points(array[rng.integers(0, height, _LOOKED_AT), k]))
    if min(steps) > _AS_AT_RANDOM * min(in_row, in_column):
        warnings.warn(
            f"{name}: its {height} x {width} points were read as one cloud, and neighbours among them lie as far apart "
            f"as any two; if they are {height} clouds, give one of them, x[0]",
            UserWarning,
            stacklevel=4,
        )


def _apart(a: Array, b: Array) -> float:
    """The median distance of points to others; 0 where too few are seen, as a missing return is NaN or the origin."""
    seen = np.all([np.isfinite(each).all(axis=1) & each.any(axis=1) for each in (a, b)], axis=0)
    return float(np.median(np.linalg.norm(a - b, axis=1)[seen])) if seen.sum() >= _FEWEST else 0.0


def _points(rows: NDArray[Any]) -> Array:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.asarray(np.ma.filled(rows[:, :3].astype(np.float64), np.nan))
