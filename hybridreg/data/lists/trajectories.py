# SPDX-License-Identifier: MIT
"""Trajectories in KITTI's format: twelve numbers a line, the upper three rows of T_world_sensor."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.io.faults import fault
from hybridreg.io.whole_files import read_whole

Array = NDArray[np.float64]

# Text with four digits is off by about 1e-4; beyond a hundredth it is not rounding.
_ROUNDING = 1e-2


def read_poses(path: Path) -> Array:
    """Poses (N, 4, 4) of a KITTI-format file, rotations orthogonalised.

    Raises
    ------
    FileNotFoundError
        Nothing lies at `path`.
    ValueError
        No lines, a line without twelve numbers, or one that is not a rigid motion.
    """
    lines = [line for line in _text(path).splitlines() if line.strip()]
    if not lines:
        raise fault(str(path), "holds no pose", "write twelve numbers a line, one line a frame")
    rows = [_numbers(line, 12, f"{path}, line {n}") for n, line in enumerate(lines, 1)]
    return np.stack([_pose(row, f"{path}, line {n}") for n, row in enumerate(rows, 1)])


def read_calibration(path: Path) -> Array:
    """T_camera_velodyne (4, 4): the line `Tr:` (or `Tr_velo_to_cam:`) of a KITTI calibration file."""
    for line in _text(path).splitlines():
        key, _, rest = line.partition(":")
        if key.strip() in ("Tr", "Tr_velo_to_cam"):
            return _pose(_numbers(rest, 12, f"{path}, {key}"), f"{path}, {key}")
    raise fault(str(path), "has no line `Tr:`", "use the calib.txt of KITTI's odometry calibration files")


def read_matrix(path: Path) -> Array:
    """Rigid motion (4, 4) from a text file with sixteen (or twelve) numbers."""
    numbers = _text(path).replace(",", " ").split()
    if len(numbers) not in (12, 16):
        raise fault(str(path), f"holds {len(numbers)} numbers", "a pose has sixteen, four a line")
    return _pose(_numbers(" ".join(numbers), len(numbers), str(path)), str(path))


def rigid(matrix: Any, label: str) -> Array:
    """A pose (4, 4) with its rotation orthogonalised, if that changes it by no more than rounding.

    Raises
    ------
    ValueError
        Not 4x4, not finite, or off by more than a hundredth: scaled, sheared, mirrored or transposed.
    """
    T = se3.check(matrix, label, tolerance=_ROUNDING)
    return se3.from_rt(se3.project(T[:3, :3]), T[:3, 3])


def _pose(numbers: list[float], label: str) -> Array:
    T = np.eye(4)
    T.flat[: len(numbers)] = numbers
    return rigid(T, label)


def _numbers(line: str, count: int, label: str) -> list[float]:
    try:
        numbers = [float(word) for word in line.split()]
    except ValueError as error:
        raise fault(label, f"is not all numbers ({error})") from error
    if len(numbers) != count:
        raise fault(label, f"has {len(numbers)} numbers, not {count}")
    return numbers


def _text(path: Path) -> str:
    try:
        return read_whole(path).decode("utf-8")
    except UnicodeDecodeError as error:
        raise fault(str(path), "is not text") from error
