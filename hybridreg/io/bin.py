# SPDX-License-Identifier: MIT
"""Headerless float32 rows: four numbers a point as KITTI writes them, or five as nuScenes does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.records import stack_axes
from hybridreg.io.signatures import looks_like_text

_KITTI, _NUSCENES = 4, 5
_FARTHEST = 1e7  # metres: beyond any map grid, while bytes that are no coordinates reach 1e38
_MOST_RINGS = 1024
_TOLERATED = 0.01  # share of rows that may contradict a layout
_NO_HEADER = "this format has no header to ask, so convert it to .npy with one point (x, y, z) a row"


def parse_bin(data: bytes, name: str) -> NDArray[np.float64]:
    """Read x, y and z of float32 rows x, y, z, intensity (KITTI) or x, y, z, intensity, ring (nuScenes).

    The file's size decides between four and five numbers. Where it allows both (a multiple of 80), the
    values decide: is the fifth a ring's number, is the fourth an intensity? Where they allow neither, the
    name does (five for `.pcd.bin`); where they allow both, the file is refused. Shape (N, 3).
    """
    if looks_like_text(data):
        raise fault(name, "is text, not float32 rows", "rename it to end in .txt")
    possible = [width for width in (_KITTI, _NUSCENES) if len(data) % (4 * width) == 0]
    if not possible:
        problem = f"its {len(data)} bytes are no multiple of 16 (x, y, z, intensity) nor of 20 (with a ring)"
        raise fault(name, problem, f"it was cut short, or has another layout: {_NO_HEADER}")
    width = possible[0] if len(possible) == 1 else _width_by_values(data, name)
    rows = _rows(data, width)
    _refuse_implausible(rows, name)
    return stack_axes(rows[:, 0], rows[:, 1], rows[:, 2])


def _rows(data: bytes, width: int) -> NDArray[np.float32]:
    return np.frombuffer(data, dtype="<f4").reshape(-1, width)


def _width_by_values(data: bytes, name: str) -> int:
    fits_four = _is_intensity(_rows(data, _KITTI)[:, 3])
    fits_five = _is_ring(_rows(data, _NUSCENES)[:, 4])
    if fits_four and fits_five:
        rows = f"{len(data) // 16} rows of four numbers or {len(data) // 20} of five"
        raise fault(name, f"its {len(data)} bytes are {rows}, and both look right", _NO_HEADER)
    if fits_four != fits_five:
        return _KITTI if fits_four else _NUSCENES
    return _NUSCENES if name.lower().endswith(".pcd.bin") else _KITTI


def _is_ring(column: NDArray[np.float32]) -> bool:
    in_range = np.all((column >= 0) & (column < _MOST_RINGS))  # NaN is not, so nothing below meets one
    return bool(in_range and np.all(column == np.round(column)))


def _is_intensity(column: NDArray[np.float32]) -> bool:
    return bool(np.mean(~(column >= 0)) <= _TOLERATED)


def _refuse_implausible(rows: NDArray[np.float32], name: str) -> None:
    width = rows.shape[1]
    xyz = rows[:, :3]
    far = float(np.mean(np.any(np.isfinite(xyz) & (np.abs(xyz) > _FARTHEST), axis=1)))
    if far > _TOLERATED:
        problem = f"read as rows of {width} float32, {far:.0%} of the points lie beyond {_FARTHEST:g} m"
        raise fault(name, problem, f"it has another layout: {_NO_HEADER}")
    negative = rows[rows[:, 3] < 0, 3]
    # A constant is a sensor's "no intensity"; varied negative numbers are coordinates out of step.
    if len(negative) > _TOLERATED * len(rows) and negative.min() < negative.max():
        problem = f"read as rows of {width} float32, {len(negative)} of {len(rows)} intensities are negative"
        raise fault(name, problem, f"it has another layout: {_NO_HEADER}")
