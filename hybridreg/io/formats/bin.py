# SPDX-License-Identifier: MIT
"""Headerless float32 rows: three numbers a point (PointNet), four (KITTI), five (nuScenes), six (Waymo) or more."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.formats.bin_layouts import (
    are_channels,
    refuse_other_types,
    refuse_time_in_front,
    rows_together,
    wider,
)
from hybridreg.io.meaning.spherical import tell_spherical
from hybridreg.io.record_fields import stack_axes
from hybridreg.io.signatures import looks_like_text

_WIDTHS = (3, 4, 5, 6)
# COLMAP's maps of depths and normals begin so (its documentation, Output Format): width, height and channels.
_MAP = re.compile(rb"(\d{1,6})&(\d{1,6})&\d{1,3}&")
_KITTI = 4  # numbers a row
_NUSCENES = 5
_FARTHEST = 1e7  # metres: beyond any map grid, while bytes that are not coordinates go up to 1e38
_MOST_RINGS = 1024
_TOLERATED = 0.01  # share of rows that may contradict a layout
_NO_HEADER = (
    "this format has no header to tell its layout, so convert it to .npy with one point (x, y, z) a row"
)
_LOOKED_AT = 120_000  # numbers sampled to find the width
# A column differs from all numbers together when their distributions are further apart than both.
_CHANCE = 2.5  # times the distance expected by chance; by hand
_LEAST = 0.06  # distance of distributions (Kolmogorov and Smirnov's); by hand
# A width explains the numbers as well as the best one from this share of its contrast on.
_AS_GOOD = 0.9
_BLOCK = 60  # numbers, a multiple of every width


def parse_bin(data: bytes, name: str) -> NDArray[np.float64]:
    """Read x, y and z of float32 rows of three to six numbers, or of up to sixteen where those clearly fit better;
    values after z are ignored. Shape (N, 3).

    Only at the right width do columns differ: x is distributed differently from z, an intensity differently from both,
    while at a wrong width each column is the same mixture of all. The narrowest width at which they differ most is
    taken. Where none makes them differ, the file's size, the values (is the fifth a ring number, the fourth an
    intensity?) and the name (five for `.pcd.bin`) decide between four and five; where that allows both, the file is
    refused.

    Raises
    ------
    ValueError
        Text; a map of COLMAP; a size or values that fit no width, or several; or as `refuse_other_types` and
        `refuse_time_in_front`.
    """
    shape = _MAP.match(data)
    if shape is not None:
        wide, high = (int(each) for each in shape.groups())
        problem = f"is a map of depths or normals of COLMAP ({wide} x {high}), not a cloud"
        raise fault(name, problem, "give the cloud that COLMAP fuses of its maps, fused.ply")
    if looks_like_text(data):
        raise fault(name, "is text, not float32 rows", "rename it to end in .txt")
    refuse_other_types(data, name)
    possible = [width for width in _WIDTHS if len(data) % (4 * width) == 0]
    likely, sure = _width_by_columns(data)
    told = likely if sure else 0
    if not possible or (told and told not in possible):
        # A radar's rows of seven in a number that no narrower rows divide.
        numbers = np.frombuffer(data, dtype="<f4", count=len(data) // 4)
        wide = wider(numbers, likely, _contrast) if len(data) % 4 == 0 else likely
        if wide not in _WIDTHS:
            return _points(_rows(data, wide), name)
    if told and told not in possible:
        problem = f"its numbers repeat after {told}, and its {len(data)} bytes are no multiple of {4 * told}"
        raise fault(name, problem, f"it was cut short, or has another layout: {_NO_HEADER}")
    if not possible:
        sizes = ", ".join(f"{4 * width}" for width in _WIDTHS)
        problem = f"its {len(data)} bytes are no multiple of {sizes} (three to six float32 a point)"
        raise fault(name, problem, f"it was cut short, or has another layout: {_NO_HEADER}")
    width = told or (possible[0] if len(possible) == 1 else _width_by_values(data, possible, likely, name))
    numbers = np.frombuffer(data, dtype="<f4", count=len(data) // 4)
    if are_channels(numbers, width, _contrast):
        problem = f"its {len(data) // 4} numbers come channel after channel, not in rows"
        cure = "save numpy.fromfile(path, 'float32').reshape(4, -1).T, or as many as it has channels, as .npy"
        raise fault(name, problem, cure)
    width = wider(numbers, width, _contrast)
    rows = _rows(data, width)
    rows = _rows(data, width * rows_together(rows))
    return _points(rows, name)


def _points(rows: NDArray[np.float32], name: str) -> NDArray[np.float64]:
    refuse_time_in_front(rows, name)
    _refuse_implausible(rows, name)
    tell_spherical(rows, name)
    return stack_axes(rows[:, 0], rows[:, 1], rows[:, 2])


def _rows(data: bytes, width: int) -> NDArray[np.float32]:
    return np.frombuffer(data, dtype="<f4", count=len(data) // (4 * width) * width).reshape(-1, width)


def _width_by_columns(data: bytes) -> tuple[int, bool]:
    """The narrowest width at which columns differ as much as at any other, and whether by more than chance."""
    numbers = np.frombuffer(data, dtype="<f4", count=len(data) // 4)
    if len(numbers) > _LOOKED_AT:  # whole rows of every width, from all over the file
        blocks = numbers[: len(numbers) // _BLOCK * _BLOCK].reshape(-1, _BLOCK)
        numbers = np.ravel(blocks[np.linspace(0, len(blocks) - 1, _LOOKED_AT // _BLOCK).astype(int)])
    contrasts = {width: _contrast(numbers, width) for width in _WIDTHS}
    best = max(contrasts.values())
    chance = _CHANCE / np.sqrt(max(len(numbers) // max(_WIDTHS), 1))
    width = next(width for width, contrast in contrasts.items() if contrast >= _AS_GOOD * best)
    # With few points the contrast at twice the width may be larger by chance.
    width = 3 if width == 6 and _halves_agree(numbers) else width
    return width, best >= max(chance, _LEAST)


def _halves_agree(numbers: NDArray[np.float32]) -> bool:
    rows = numbers[: len(numbers) // 6 * 6].reshape(-1, 6)
    columns = [np.sort(column[np.isfinite(column)]) for column in rows.T]
    fewest = min(map(len, columns))
    if fewest == 0:
        return False
    gaps = (
        np.abs(_shares_below(one, other) - _shares_below(other, other)).max()
        for one, other in zip(columns[:3], columns[3:], strict=True)
    )
    return max(gaps) <= _CHANCE * np.sqrt(2.0 / fewest)


def _contrast(numbers: NDArray[np.float32], width: int) -> float:
    """Largest distance (Kolmogorov and Smirnov's) between a column's distribution and that of all numbers."""
    rows = numbers[: len(numbers) // width * width].reshape(-1, width)
    every = np.sort(rows[np.isfinite(rows)])
    if len(every) == 0:
        return 0.0
    levels = every[np.linspace(0, len(every) - 1, 200).astype(int)]
    all_below = _shares_below(every, levels)
    columns = [np.sort(column[np.isfinite(column)]) for column in rows.T]
    return max(float(np.abs(_shares_below(c, levels) - all_below).max()) for c in columns if len(c))


def _shares_below(ordered: NDArray[np.float32], levels: NDArray[np.float32]) -> NDArray[np.float64]:
    return np.searchsorted(ordered, levels, side="right") / len(ordered)


def _width_by_values(data: bytes, possible: list[int], likely: int, name: str) -> int:
    fits = [
        width
        for width, fitting in (
            (_KITTI, lambda: _is_intensity(_rows(data, _KITTI)[:, 3])),
            (_NUSCENES, lambda: _is_ring(_rows(data, _NUSCENES)[:, 4])),
        )
        if width in possible and fitting()
    ]
    if len(fits) > 1 or (3 in possible and fits and fits[0] != likely):
        counts = " or ".join(f"{len(data) // (4 * width)} rows of {width}" for width in possible)
        raise fault(name, f"its {len(data)} bytes are {counts} numbers, and several look right", _NO_HEADER)
    if fits:
        return fits[0]
    if 3 in possible:  # columns that do not differ, none of them an intensity: coordinates only
        return 3
    return _NUSCENES if name.lower().endswith(".pcd.bin") and _NUSCENES in possible else possible[0]


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
    if width not in (_KITTI, _NUSCENES):
        return
    negative = rows[rows[:, 3] < 0, 3]
    # A constant means that the sensor gives no intensity; varying negative numbers are misaligned coordinates.
    if len(negative) > _TOLERATED * len(rows) and negative.min() < negative.max():
        problem = f"read as rows of {width} float32, {len(negative)} of {len(rows)} intensities are negative"
        raise fault(name, problem, f"it has another layout: {_NO_HEADER}")
