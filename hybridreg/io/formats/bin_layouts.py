# SPDX-License-Identifier: MIT
"""Layouts of headerless files beyond rows of three to six float32: wider rows, channel after channel, other types."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault

Numbers = NDArray[np.float32]
Contrast = Callable[[Numbers, int], float]

_WIDEST = 16  # numbers a row: PCL's points have up to twelve
_FEWEST = 20  # rows of each part that tell
_MANY = 500  # rows at which a width's contrast is hardly chance
_LOOKED_AT = 120_000  # numbers
# Contrast by which another width must win, and that of the parts of a file that are channels; by hand.
_CLEARLY = 1.25
# The same of fewer rows: lasers stay below 1.8 by chance at 60 rows, radars of seven numbers above 6.
_OVERWHELMINGLY = 3.0
_CHANNELS = 0.2
_ALIKE = 1.05
_WIDER = 20.0  # times as far across: no two halves of a scan, by hand
_MOST_WHOLE = 0.5  # share of numbers that are whole from which all are
_LARGEST = 2**23  # as whole numbers: below it a float is denormal, and above minus it no number
_NEGATIVE_NAN = -(2**22)  # what processors of the x86 family make of 0/0, as a whole number
_NEAREST = 1e-6  # metres; no cloud lies within that
_ONE_CLOUD = 1e-7  # of a time since 1970, by which those of one cloud differ at most: three minutes
# Since 1970, until 2039: seconds in double precision, and milli-, micro- or nanoseconds as whole numbers.
_SECONDS, _COUNTED = (1e8, 1e10), (1e11, 2.2e18)


def wider(numbers: Numbers, width: int, contrast: Contrast) -> int:
    """A width that explains the numbers clearly better than `width` of three to six; that, where none does."""
    some = numbers[:_LOOKED_AT]
    narrow = contrast(some, width)
    for wide in range(7, _WIDEST + 1):
        rows = len(some) // wide
        if not wide % width or len(numbers) % wide or rows < _FEWEST:
            continue
        least = (_CLEARLY if rows >= _MANY else _OVERWHELMINGLY) * narrow
        if contrast(some, wide) >= max(least, _CHANNELS):
            return wide
    return width


def rows_together(rows: Numbers) -> int:
    """How many rows (N, width) make one point: 1 where all hold coordinates.

    Where every second (third, fourth) row has other kinds of numbers as x, y or z, the rows are too narrow. That z
    differs alone says nothing: some sensors fire their upper and lower lasers in turn.
    """
    for together in range(2, _WIDEST // rows.shape[1] + 1):
        if len(rows) % together or len(rows) // together < _FEWEST:
            continue
        some = rows[:_LOOKED_AT, :3]
        first, *others = (_points_alone(some[phase::together]) for phase in range(together))
        if any(len(first) and len(other) and _differ(first, other) for other in others):
            return together
    return 1


def are_channels(numbers: Numbers, width: int, contrast: Contrast) -> bool:
    """Whether all x come first, then all y, instead of rows of `width` numbers."""
    if len(numbers) < 3 * _FEWEST:
        return False
    some = numbers[:_LOOKED_AT]
    finite = np.where(np.isfinite(some), some, 0.0)
    # In rows the next number is another coordinate; in a channel it is that of the next point.
    next_, next_row = (_median_step(finite, step) for step in (1, width))
    if next_ > _ALIKE * next_row:
        return False
    least = max(contrast(some, width), _CHANNELS)
    return any(_contrast_of_parts(numbers, parts, contrast) > least for parts in (3, 4, 5, 6))


def refuse_other_types(data: bytes, name: str) -> None:
    """Refuse numbers that are no float32: whole ones, of which floats are zeros or no numbers.

    Raises
    ------
    ValueError
        They are int32, int64 or smaller whole numbers.
    """
    count = len(data) // 4
    whole = np.frombuffer(data, dtype="<i4", count=count)
    some = whole[np.r_[: min(count, _LOOKED_AT), max(0, count - _LOOKED_AT) : count]].astype(np.int64)
    kept = some[(some != 0) & (some != _NEGATIVE_NAN)]
    if len(kept) and np.mean(np.abs(kept) < _LARGEST) > _MOST_WHOLE:
        long = count % 2 == 0 and np.isin(some[1:_FEWEST:2], (0, -1)).all()
        _refuse_whole(name, "its numbers are whole ones, not float32", "int64" if long else "int32")
    floats = np.frombuffer(data, dtype="<f4", count=count)
    with np.errstate(invalid="ignore"):
        nearest = floats.any() and not (np.abs(floats) >= _NEAREST).any() and not np.isnan(floats).all()
    if nearest:
        _refuse_whole(name, f"read as float32, all its numbers are smaller than {_NEAREST:g}", "int32")


def refuse_time_in_front(rows: NDArray[np.float32], name: str) -> None:
    """Refuse records, read as rows of float32 (N, width), whose first two numbers are the halves of one time.

    Raises
    ------
    ValueError
        They are, in double precision or as a whole number.
    """
    if len(rows) < _FEWEST or rows.shape[1] < 5:
        return
    front = np.ascontiguousarray(rows[:, :2])
    for kind, (low, high) in (("f8", _SECONDS), ("u8", _COUNTED)):
        times = front.view(f"<{kind}").ravel().astype(np.float64)
        first, last = float(times.min()), float(times.max())
        if low <= first and last <= high and last - first <= _ONE_CLOUD * first:
            problem = f"its records of {4 * rows.shape[1]} bytes begin with a time of eight bytes, not with x"
            fields = f"[('t', '<{kind}'), ('xyz', '<f4', 3), ('more', '<f4', {rows.shape[1] - 5})]"
            raise fault(name, problem, f'save numpy.fromfile(path, {fields})["xyz"] as .npy')


def _contrast_of_parts(numbers: Numbers, parts: int, contrast: Contrast) -> float:
    if len(numbers) % parts:
        return 0.0
    some = numbers.reshape(parts, -1)[:, :: max(1, len(numbers) // _LOOKED_AT)]
    return contrast(np.ravel(some.T), parts)


def _points_alone(rows: Numbers) -> Numbers:
    finite = rows[np.isfinite(rows).all(axis=1)]
    return finite[finite.any(axis=1)]  # without missing returns


def _differ(some: Numbers, others: Numbers) -> bool:
    if [*map(_kind, some.T)] != [*map(_kind, others.T)]:
        return True
    spreads = [np.ptp(rows[:, :2].astype(np.float64), axis=0) for rows in (some, others)]
    return bool((np.maximum(*spreads) > _WIDER * np.minimum(*spreads)).all())


def _kind(column: Numbers) -> str:
    if column.min() == column.max():
        return "constant"
    return "whole" if np.all(column == np.round(column)) else "free"


def _median_step(numbers: NDArray[np.floating], step: int) -> float:
    with np.errstate(over="ignore", invalid="ignore"):
        return float(np.median(np.abs(numbers[step:] - numbers[:-step])))


def _refuse_whole(name: str, problem: str, kind: str) -> None:
    cure = f"save numpy.fromfile(path, {kind!r}).reshape(-1, 3) * UNIT as .npy: the type may be shorter (int16), "
    cure += "a row has 4 numbers where one is an intensity, and UNIT is in metres, 0.001 of millimetres"
    raise fault(name, problem, cure)
