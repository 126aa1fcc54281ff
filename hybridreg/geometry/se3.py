# SPDX-License-Identifier: MIT
"""Rigid motions as 4x4 matrices that map source points to target points, `q = R p + t`."""

from __future__ import annotations

import inspect
from collections import UserList
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# R R^T of a rotation in double precision is off by less.
_EXACT = 1e-12
# Where results of registrations keep their pose: ours and Open3D's, small_gicp's. Where other libraries' poses keep
# their matrix: gtsam and Sophus, scipy, pinocchio, the kit of Argoverse 2; evalio, roma, symforce.
_HOLD = (
    "transformation",
    "T_target_source",
    "matrix",
    "as_matrix",
    "homogeneous",
    "transform_matrix",
    "to_mat",
    "to_homogeneous",
    "to_homogenous_matrix",
    "homogeneous_matrix",
)
# Where those without a matrix keep a rotation and a translation: kiss_matcher's; by hand.
_APART = (("rotation", "translation"), ("R", "t"))
# Where ROS's messages keep theirs, inside of others perhaps.
_IN_ROS = (("pose", "position", "orientation"), ("transform", "translation", "rotation"))


def from_rt(R: Array, t: Array) -> Array:
    """Join rotation (..., 3, 3) and translation (..., 3) to (..., 4, 4)."""
    T = np.zeros((*R.shape[:-2], 4, 4))
    T[..., :3, :3] = R
    T[..., :3, 3] = t
    T[..., 3, 3] = 1.0
    return T


def apply(T: Array, points: Array) -> Array:
    """Move points (..., N, 3) by T (..., 4, 4)."""
    return points @ np.swapaxes(T[..., :3, :3], -1, -2) + T[..., None, :3, 3]


def inverse(T: Array) -> Array:
    """Inverse of a rigid motion (..., 4, 4)."""
    R = np.swapaxes(T[..., :3, :3], -1, -2)
    return from_rt(R, -(R @ T[..., :3, 3:])[..., 0])


def about(centre: Array, R: Array, shift: Array | float = 0.0) -> Array:
    """Rigid motion (..., 4, 4) that rotates by R (..., 3, 3) about a point (..., 3), and then translates it by `shift`
    (..., 3)."""
    return from_rt(R, centre - (R @ centre[..., None])[..., 0] + shift)


def exp(twist: Array) -> Array:
    """Rigid motion (4, 4) of a twist (6,): rotation vector in radians first, then the translation itself.

    The translation is not coupled to the rotation, which is what a Gauss-Newton step on
    `R p + t` linearised in place needs.
    """
    return from_rt(rotation_about(twist[:3]), np.asarray(twist[3:], dtype=np.float64))


def rotation_about(vector: Array) -> Array:
    """Rotation (..., 3, 3) about a vector (..., 3) whose length is the angle in radians."""
    from scipy.spatial.transform import Rotation

    R: Array = Rotation.from_rotvec(vector).as_matrix()
    return R


def log_rotation(R: Array) -> Array:
    """Vector (3,) in radians that `rotation_about` turns into R (3, 3); its length lies in [0, pi]."""
    from scipy.spatial.transform import Rotation

    vector: Array = Rotation.from_matrix(R).as_rotvec()
    return vector


def skew(v: Array) -> Array:
    """Matrix (3, 3) of the cross product with v (3,)."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def yaw(angle_deg: float) -> Array:
    """Rigid motion (4, 4) that rotates about z."""
    return from_rt(rotation_about(np.array([0.0, 0.0, np.deg2rad(angle_deg)])), np.zeros(3))


def project(M: Array) -> Array:
    """Nearest rotation to a 3x3 matrix: orthogonal, determinant +1."""
    U, _, Vt = np.linalg.svd(M)
    flip = np.sign(np.linalg.det(U @ Vt)) or 1.0
    return U @ np.diag([1.0, 1.0, flip]) @ Vt


def angle_deg(R: Array) -> float:
    """Angle of a rotation (3, 3), in [0, 180] degrees.

    From sine and cosine together: the arc cosine alone loses half the digits near 0 and 180.
    """
    sine = 0.5 * np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return float(np.degrees(np.arctan2(sine, 0.5 * (np.trace(R) - 1.0))))


def random_rotation(rng: np.random.Generator) -> Array:
    """Uniformly distributed rotation (3, 3)."""
    quaternion = rng.normal(size=4)
    w, x, y, z = quaternion / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


_POSE = (4, 4)
_DOWN = "; where the nine run down the columns, as klampt's do, transpose the 3x3"
_TWELVE = (
    "; if they are rows of R and t in turn: numpy.vstack([T.reshape(3, 4), [0, 0, 0, 1]]); if R is before t: "
    "numpy.vstack([numpy.column_stack([T[:9].reshape(3, 3), T[9:]]), [0, 0, 0, 1]])"
)
# What to do with the numbers of a pose in another shape.
_CURES = {
    (3, 4): "; append the row [0, 0, 0, 1]",
    (12,): _TWELVE,
    (16,): "; if they are row after row: T.reshape(4, 4)",
    (3, 3): "; a rotation alone goes into the upper left of numpy.eye(4)",
    (7,): "; a quaternion and a translation: scipy.spatial.transform.Rotation.from_quat(xyzw).as_matrix()",
}


def check(T: Any, name: str = "T", tolerance: float = 1e-4) -> Array:
    """Return T as (4, 4) float64 if it is a rigid motion.

    Raises
    ------
    ValueError
        Not numbers, several poses, wrong shape, not finite, last row not (0, 0, 0, 1), or a rotation off by more than
        `tolerance`.
    """
    # spatialmath's SE3 may hold any number of poses, and numpy sees the first of them alone.
    if isinstance(T, UserList) and hasattr(type(T), "__array_interface__") and len(T) != 1:
        cure = f", such as {name}[0]" if len(T) else ""
        raise ValueError(f"{name}: holds {len(T)} poses; give one pose{cure}")
    try:
        matrix = np.asarray(T, dtype=np.float64)
    except Exception as error:  # an object of another library may raise anything
        raise ValueError(f"{name}: expected numbers of shape (4, 4) ({error}){_cure_of(T, name)}") from error
    if matrix.shape != (4, 4):
        cure = _planar(matrix, name) or _CURES.get(matrix.shape, "")
        if matrix.ndim == 3 and matrix.shape[1:] in (_POSE, (3, 4)):
            cure = _one_of(len(matrix), name)
        raise ValueError(f"{name}: expected shape (4, 4), got {matrix.shape}{cure}")
    if not np.isfinite(matrix).all():
        raise ValueError(f"{name}: the matrix is not finite")
    if not np.allclose(matrix[3], [0, 0, 0, 1], atol=1e-9):
        raise ValueError(f"{name}: the last row is {matrix[3]}, expected [0 0 0 1]; {_last_row(matrix[3])}")
    with np.errstate(over="ignore", invalid="ignore"):
        off = _off_orthogonal(matrix[:3, :3])
        determinant = float(np.linalg.det(matrix[:3, :3]))
    if not off <= tolerance or determinant < 0:
        raise ValueError(
            f"{name}: the upper left 3x3 block is not a rotation (R R^T is off by {off:.2g}, "
            f"determinant {determinant:.3g}); remove scale or reflection"
        )
    return matrix


def _cure_of(T: Any, name: str) -> str:
    """What to do with an object that is no matrix, where it is known."""
    if _has(T, "numpy") and _has(T, "cpu"):  # a tensor: torch's with a gradient or in bfloat16, Open3D's
        return f"; give its {'detach().cpu().double()' if _has(T, 'detach') else 'cpu()'}.numpy()"
    if _has(T, "GetElement"):  # VTK's matrix, as its transforms have one
        return f"; give numpy.array([[{name}.GetElement(i, j) for j in range(4)] for i in range(4)])"
    held = next((each for each in _HOLD if _has(T, each) and not _asks(getattr(T, each))), "")
    if held:
        count = None if isinstance(T, dict) else _count(T)  # scipy's RigidTransform may be any number of them
        one = "" if count is None else _one_of(count, name)
        call = f"{held}{'()' if callable(getattr(T, held)) else ''}"
        return f"{one}.{call}" if one else f"; give its {call}"
    if _has(T, "T") and callable(T.T):  # scikit-robot's Coordinates
        return "; give its T()"
    for outer, place, turn in _IN_ROS:
        inner = getattr(T, outer) if _has(T, outer) else T
        if _has(inner, place) and _has(inner, turn) and _has(getattr(inner, turn), "w"):
            return (
                f"; of a message of ROS: T = numpy.eye(4), T[:3, 3] = x, y, z of its {place}, T[:3, :3] = "
                f"scipy.spatial.transform.Rotation.from_quat([q.x, q.y, q.z, q.w]).as_matrix() of its {turn}"
            )
    apart = next((pair for pair in _APART if _size_of(T, pair[0]) == 9 and _size_of(T, pair[1]) == 3), None)
    if apart and not isinstance(T, dict):
        return f"; give {_joined(*(f'{name}.{each}' for each in apart))}"
    if isinstance(T, (tuple, list)) and [_size(each) for each in T] == [9, 3]:
        cure = f"; of a rotation and a translation: {_joined(f'{name}[0]', f'{name}[1]')}"
        return cure if np.ndim(T[0]) > 1 else f"{cure}{_DOWN}"
    if isinstance(T, dict):
        return f"; give the matrix in it, of {', '.join(map(str, T))}"[:200]
    return ""


def _joined(R: str, t: str) -> str:
    parts = f"numpy.column_stack([numpy.reshape({R}, (3, 3)), numpy.reshape({t}, 3)])"
    return f"numpy.vstack([{parts}, [0, 0, 0, 1]])"


def _asks(held: Any) -> bool:
    """Whether it is a method that must be told something, as scikit-robot's `transformation(other)`."""
    try:
        parameters = inspect.signature(held).parameters.values() if callable(held) else ()
    except (TypeError, ValueError):  # built in
        return False
    return any(each.default is each.empty and each.kind < each.VAR_POSITIONAL for each in parameters)


def _planar(M: Array, name: str) -> str:
    """What to do with a pose in the plane, as gtsam's Pose2, spatialmath's SE2 and OpenCV's 2x3 matrices are."""
    if M.shape not in ((2, 3), (3, 3)) or not np.isfinite(M).all() or not M.any():
        return ""
    # Without a shift it is a rotation about z as well.
    if M.shape == (3, 3) and not (np.allclose(M[2], [0.0, 0.0, 1.0], atol=1e-9) and M[:2, 2].any()):
        return ""
    return f"; of a pose in the plane: M, T = numpy.asarray({name}), numpy.eye(4); T[:2, [0, 1, 3]] = M[:2]"


def _last_row(row: Array) -> str:
    if row[:3].any():
        return "is the matrix transposed?"
    if row[3] == 0.0:
        return "if it is the logarithm of a pose, give its scipy.linalg.expm"
    return "a number there is a scale, which a rigid motion has not: give its rotation and translation"


def _one_of(count: int, name: str) -> str:
    return (
        f"; give its one pose, {name}[0]"
        if count == 1
        else f"; of its {count} poses give one, such as {name}[0]"
    )


def _has(x: Any, attribute: str) -> bool:
    try:
        return hasattr(x, attribute)
    except Exception:  # a dictionary whose attributes are its entries may raise KeyError
        return False


def _count(x: Any) -> int | None:
    try:
        return len(x)
    except TypeError:
        return None


def _size(value: Any) -> int:
    try:
        return int(np.asarray(value, dtype=np.float64).size)
    except (TypeError, ValueError, OverflowError):
        return 0


def _size_of(x: Any, attribute: str) -> int:
    return _size(getattr(x, attribute)) if _has(x, attribute) else 0


def rounded(T: Any, name: str, tolerance: float) -> Array:
    """As `check` of a matrix that was written down with few digits: a rotation that is off by up to `tolerance` is made
    exact unless it is so already."""
    matrix = check(T, name, tolerance)
    R = matrix[:3, :3]
    return matrix if _off_orthogonal(R) <= _EXACT else from_rt(project(R), matrix[:3, 3])


def off_rotation(R: Array) -> float:
    """By how much R (3, 3), finite, is no rotation: the largest part of R R^T - 1; infinite for a reflection."""
    return _off_orthogonal(R) if np.linalg.det(R) > 0.0 else np.inf


def _off_orthogonal(R: Array) -> float:
    return float(np.abs(R @ R.T - np.eye(3)).max())


def turn_to_z(up: Array) -> Array:
    """The shortest rotation (3, 3) that brings a unit vector (3,) to z; about x where it points the other way."""
    z = np.array([0.0, 0.0, 1.0])
    axis = np.cross(up, z)
    sine, cosine = float(np.linalg.norm(axis)), float(up @ z)
    direction = axis / sine if sine > 1e-9 else np.array([1.0, 0.0, 0.0])
    return rotation_about(np.arctan2(sine, cosine) * direction)
