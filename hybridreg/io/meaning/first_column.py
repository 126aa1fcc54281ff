# SPDX-License-Identifier: MIT
"""First columns that are no x: numbers of rows, ranges, times, labels, indices of a batch, pixels, normals."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.meaning.repeated_clock import rises_again

Array = NDArray[np.float64]

FEWEST = 20  # rows that tell
_LOOKED_AT = 5_000  # rows
_WIDEST = 6  # columns looked at: a normal and a point
_NEARLY_ALL = 0.99  # share of rows
_SAME = 2e-3  # of a length, as far as stored numbers are rounded
_MOST_LABELS = 256  # rings, classes, clouds of a batch
_MOST_PIXELS = 100_000  # columns of a scanner's panorama and more; a map's coordinates are larger
_EPOCH = 1e8  # seconds since 1970 in 1973; no map grid goes so far in metres
_STRAIGHT = 0.05  # of its span: a clock's distance from a straight line, by hand
_SWEEP = 1.0  # seconds: only a time within a sweep goes from below to above zero


def check_first_column(rows: NDArray[Any], name: str, cure: str) -> None:
    """Refuse a table (N, C) whose first column certainly is no x, and warn where it probably is none.

    Only of four or more columns: three are x, y and z. `cure` says how to leave the first one out.

    Raises
    ------
    ValueError
        The first column counts the rows, or is the distance of the next three from the origin.
    """
    if rows.shape[1] <= 3 or len(rows) < FEWEST:
        return
    refuse_row_numbers(rows[:, 0], name, cure)
    some = _some(rows)
    if len(some) < FEWEST:
        return
    if _is_range(some):
        raise fault(name, "its first column is the length of the next three, not a coordinate", cure)
    if _are_pixels(some):
        warnings.warn(
            f"{name}: its first two columns were read as x and y, and hold whole numbers, each pair of them once; "
            "if they are row and column of an image, name the columns (row column x y z), or give x, y and z first",
            UserWarning,
            stacklevel=3,
        )
    elif found := _doubt(some) or _repeated(rows):
        warnings.warn(
            f"{name}: its first column was read as x, and {found}; if it is no coordinate, {cure}",
            UserWarning,
            stacklevel=3,
        )
    elif _are_normals(some):
        warnings.warn(
            f"{name}: its first three columns were read as x, y and z, and have the length 1 in each row; if they are "
            "normals, give the columns of x, y and z first",
            UserWarning,
            stacklevel=3,
        )


def refuse_row_numbers(column: NDArray[Any], name: str, cure: str) -> None:
    """Refuse a column of row numbers: at least 20 values, each one more than the last.

    Raises
    ------
    ValueError
        It is one.
    """
    # As floats: the difference of unsigned numbers overflows.
    if len(column) < FEWEST or float(column[1]) - float(column[0]) != 1.0:
        return
    if np.all(np.diff(column.astype(np.float64)) == 1.0):
        raise fault(name, "its first column is a row number, not a coordinate", cure)


def looked_at(count: int) -> NDArray[np.int64]:
    """Which of so many rows are looked at, in their order. By chance, as the columns of sensors repeat evenly."""
    if count <= _LOOKED_AT:
        return np.arange(count)
    return np.unique(np.random.default_rng(0).integers(0, count, _LOOKED_AT))


def _some(rows: NDArray[Any]) -> Array:
    chosen = rows[looked_at(len(rows)), :_WIDEST]
    with np.errstate(over="ignore", invalid="ignore"):
        some = np.asarray(np.ma.filled(chosen.astype(np.float64), np.nan))
    return some[np.isfinite(some).all(axis=1)]


def _is_range(some: Array) -> bool:
    returned = some[some[:, 0] > 0.0]  # a missing return has none
    if len(returned) < FEWEST:
        return False
    off = np.abs(np.linalg.norm(returned[:, 1:4], axis=1) - returned[:, 0])
    return bool(np.mean(off <= _SAME * np.median(returned[:, 0])) >= _NEARLY_ALL)


def _doubt(some: Array) -> str:
    """What is wrong with the first column as an x; empty where nothing is."""
    first = some[:, 0]
    labels = _whole(first) and bool(first.min() >= 0.0)
    if first.min() == first.max():
        return f"is {first[0]:g} in each row, like an index in a batch" if labels and _is_batch(some) else ""
    kinds = len(np.unique(first))
    if labels and kinds <= min(_MOST_LABELS, len(first) / 3) and _are_finer(some[:, 1:3], kinds):
        return f"holds no more than {kinds} whole numbers, like a ring or a class"
    if np.median(np.abs(first)) > _EPOCH and np.median(np.abs(some[:, 1:3])) < _SAME * _EPOCH:
        return f"holds numbers of {np.median(first):.2g}, like a time"
    return "rises from row to row, like a time or a number of the row" if _is_clock(some) else ""


def _repeated(rows: NDArray[Any]) -> str:
    if not rises_again(rows, looked_at(len(rows))):
        return ""
    return "rises evenly again and again, like a time in each of several sweeps"


def _whole(values: Array) -> bool:
    return bool(np.all(values == np.round(values)))


def _is_batch(some: Array) -> bool:
    # A flat scan at one x has an intensity where a cloud with an index has its z.
    last, before = some[:, 3], some[:, 1:3]
    if (before.min(axis=0) == before.max(axis=0)).any() or last.min() == last.max():
        return False
    intensity = last.min() >= 0.0 and (last.max() <= 1.0 or (_whole(last) and not _whole(before)))
    return not intensity


def _are_finer(columns: Array, kinds: int) -> bool:
    return all(
        np.mean(each == np.round(each)) < 0.5 and len(np.unique(each)) >= 3 * kinds for each in columns.T
    )


def _is_clock(some: Array) -> bool:
    first = some[:, 0] if some[0, 0] < some[-1, 0] else some[::-1, 0]
    steps = np.diff(first)
    if (steps < 0.0).any() or _is_sorted(some) or (np.diff(some[:, 1]) > 0.0).all():
        return False
    span = first[-1] - first[0]
    if first[0] < 0.0 and span > _SWEEP:  # points sorted by x, around their sensor
        return False
    if _whole(first) and (steps > 0.0).all():
        return True
    even = np.linspace(first[0], first[-1], len(first))
    return bool(np.abs(first - even).max() <= _STRAIGHT * span)


def _is_sorted(some: Array) -> bool:
    """Whether rows of one x go on by their y, as in a grid or a table without repeats."""
    alike = np.diff(some[:, 0]) == 0.0
    steps = np.diff(some[:, 1])[alike]
    return bool(alike.mean() > 0.05 and ((steps >= 0.0).all() or (steps <= 0.0).all()))


def _are_pixels(some: Array) -> bool:
    # Of an organised scan: row, column, x, y, z. A grid of heights seldom has two columns more of that kind.
    if some.shape[1] < 5:
        return False
    first, points = some[:, :2], some[:, 2:5]
    if not _whole(first) or first.min() < 0.0 or first.max() > _MOST_PIXELS:
        return False
    points = points[points.any(axis=1)]  # others are missing returns
    if len(points) < FEWEST or (np.mean(points == np.round(points), axis=0) >= 0.5).any():
        return False
    return len(np.unique(first, axis=0)) == len(first)


def _are_normals(some: Array) -> bool:
    if some.shape[1] < 6:
        return False
    unit = [np.abs(np.linalg.norm(part, axis=1) - 1.0) <= _SAME for part in (some[:, :3], some[:, 3:6])]
    return bool(unit[0].mean() >= _NEARLY_ALL > unit[1].mean())
