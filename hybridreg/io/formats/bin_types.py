# SPDX-License-Identifier: MIT
"""Headerless files whose numbers are not float32: whole numbers, and records that begin with a time of eight bytes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault

_LOOKED_AT = 120_000  # numbers, from the front and the back alike
_MOST = 0.5  # share of numbers that are whole from which all are
_LARGEST = 2**23  # as whole numbers: below it a float is denormal, and above minus it no number
_NEGATIVE_NAN = -(2**22)  # what processors of the x86 family make of 0/0, as a whole number
_NEAREST = 1e-6  # metres; no cloud lies within that
_FEWEST = 20  # records that tell
_TOGETHER = 1e-7  # of a time since 1970, by which those of one cloud differ at most: three minutes
# Since 1970, until 2039: seconds in double precision, and milli-, micro- or nanoseconds as whole numbers.
_SECONDS, _COUNTED = (1e8, 1e10), (1e11, 2.2e18)


def refuse_other_types(data: bytes, name: str) -> None:
    """Refuse numbers that are no float32: whole ones, of which floats are zeros or no numbers, and times in front.

    Raises
    ------
    ValueError
        They are int32, int64 or smaller whole numbers, or records that begin with a time of eight bytes.
    """
    count = len(data) // 4
    whole = np.frombuffer(data, dtype="<i4", count=count)
    some = whole[np.r_[: min(count, _LOOKED_AT), max(0, count - _LOOKED_AT) : count]].astype(np.int64)
    kept = some[(some != 0) & (some != _NEGATIVE_NAN)]
    if len(kept) and np.mean(np.abs(kept) < _LARGEST) > _MOST:
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
        if low <= first and last <= high and last - first <= _TOGETHER * first:
            problem = f"its records of {4 * rows.shape[1]} bytes begin with a time of eight bytes, not with x"
            fields = f"[('t', '<{kind}'), ('xyz', '<f4', 3), ('more', '<f4', {rows.shape[1] - 5})]"
            raise fault(name, problem, f'save numpy.fromfile(path, {fields})["xyz"] as .npy')


def _refuse_whole(name: str, problem: str, kind: str) -> None:
    cure = f"save numpy.fromfile(path, {kind!r}).reshape(-1, 3) * UNIT as .npy: the type may be shorter (int16), "
    cure += "a row has 4 numbers where one is an intensity, and UNIT is in metres, 0.001 of millimetres"
    raise fault(name, problem, cure)
