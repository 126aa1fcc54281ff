# SPDX-License-Identifier: MIT
"""A pose from its numbers: a matrix, or a position with a quaternion or with angles."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, shorten

Array = NDArray[np.float64]

EXPECTED = "write a pose as four lines of four numbers, or as one line: x y z qx qy qz qw"
"""What to do with a file that holds no pose."""

ONE_POSE = "keep the one from the source to the target"
"""What to do with a file of several."""

# The last row is the translation either way; above it stands the rotation, or its transpose.
_BELOW = (
    "write three rows of four, with the last row's numbers at their ends; where points are rows that stand before the "
    "matrix, as in MATLAB's affine3d, transpose the rotation, else leave it"
)
_AFTER = (
    "write three rows of four, a row of the rotation and its number of the translation in each; where the nine run "
    "down the columns, as klampt's lists do, transpose the rotation"
)
# How far a quaternion that was written with few digits may be from length 1, and R R^T from 1; by hand.
_ROUNDED = 0.03
# Degrees from which a turn is one of a sensor upside down, and up to which it is hardly any; by hand.
_OVER, _NEAR_NONE = 150.0, 30.0
_MATRIX, _QUATERNION, _TIMED, _SIX = (12, 16), 7, 8, 6
_ANGLES = (
    'where they are x y z roll pitch yaw in radians, write <origin xyz="x y z" rpy="roll pitch yaw"/> in their place; '
    "else " + EXPECTED
)


def pose_of_numbers(values: Any, name: str, *, ordered: bool = False) -> Array:
    """A pose (4, 4) of sixteen or twelve numbers row after row, of the seven x y z qx qy qz qw, or of a time and those.
    Unless it is known that they are `ordered` so, it is told where w more likely stands first.

    Raises
    ------
    ValueError
        Not numbers, another count of them, four rows of three, nine of a rotation before a translation, or a
        quaternion whose length is not 1.
    """
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise fault(name, f"holds no pose ({shorten(error)})", EXPECTED) from error
    numbers = array.ravel()
    if array.shape == (4, 3):
        raise fault(name, "holds four rows of three numbers", _BELOW)
    if array.ndim > 1 and len(array) > 1 and array[0].size in (12, 16, _QUATERNION, _TIMED):
        raise fault(name, f"holds {len(array)} poses", ONE_POSE)
    in_one_row = array.ndim == 1 or len(array) == 1
    if numbers.size in (_QUATERNION, _TIMED) and in_one_row:
        R = _rotation(numbers[-4:], name)
        if not ordered:
            _tell_order(numbers[-4:], name)
        return _placed(numbers[-7:-4], R)
    if numbers.size not in _MATRIX:
        raise fault(name, f"holds {numbers.size} numbers", _ANGLES if numbers.size == _SIX else EXPECTED)
    T = np.eye(4)
    T.flat[: numbers.size] = numbers
    if numbers.size == 12 and in_one_row and _turns(numbers[:9].reshape(3, 3)) and not _turns(T[:3, :3]):
        raise fault(name, "holds nine numbers of a rotation and then three of a translation", _AFTER)
    return T


def number_of(word: str, name: str) -> float:
    """A word of a pose as a number.

    Raises
    ------
    ValueError
        It is none.
    """
    try:
        return float(word)
    except ValueError as error:
        raise fault(name, f"holds {shorten(word)} where a number of a pose is needed", EXPECTED) from error


def pose_of_angles(position: Sequence[float], roll_pitch_yaw: Sequence[float]) -> Array:
    """A pose (4, 4) of x y z and of radians about the fixed axes x, then y, then z, as URDF has them."""
    from scipy.spatial.transform import Rotation

    return _placed(np.array(position), Rotation.from_euler("xyz", roll_pitch_yaw).as_matrix())


def _rotation(quaternion: Array, name: str) -> Array:
    from scipy.spatial.transform import Rotation

    length = float(np.linalg.norm(quaternion))
    if not abs(length - 1.0) <= _ROUNDED:
        problem = (
            f"the last four of its {_QUATERNION} numbers have the length {length:.4g}, a quaternion has 1"
        )
        raise fault(name, problem, EXPECTED)
    R: Array = Rotation.from_quat(quaternion).as_matrix()
    return R


def _turns(M: Array) -> bool:
    with np.errstate(over="ignore", invalid="ignore"):
        return bool(np.abs(M @ M.T - np.eye(3)).max() <= _ROUNDED and np.linalg.det(M) > 0.0)


def _tell_order(quaternion: Array, name: str) -> None:
    # pytransform3d, nuScenes, COLMAP and MuJoCo have w first; a turn near none then reads as one near half a turn.
    last, first = (2.0 * float(np.degrees(np.arccos(min(1.0, abs(each))))) for each in quaternion[[3, 0]])
    if last > _OVER and first < _NEAR_NONE:
        warnings.warn(
            f"{name}: its last four numbers were read as qx qy qz qw, a turn of {last:.0f} degrees; if w stands first "
            f"in them, it is one of {first:.0f} degrees: put w last then",
            UserWarning,
            stacklevel=4,
        )


def _placed(position: Array, R: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, position
    return T
