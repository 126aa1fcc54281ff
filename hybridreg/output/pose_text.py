# SPDX-License-Identifier: MIT
"""A pose as other tools want it: ROS, URDF, CloudCompare, KITTI's and TUM's trajectories."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def quaternion(R: Array) -> Array:
    """(x, y, z, w) of a rotation (3, 3), w not negative."""
    from scipy.spatial.transform import Rotation

    q: Array = Rotation.from_matrix(R).as_quat()
    return -q if q[3] < 0.0 else q


def roll_pitch_yaw(R: Array) -> Array:
    """Radians about the fixed axes x, then y, then z: `R = Rz(yaw) Ry(pitch) Rx(roll)`."""
    return np.array(
        [
            np.arctan2(R[2, 1], R[2, 2]),
            np.arctan2(-R[2, 0], np.hypot(R[2, 1], R[2, 2])),
            np.arctan2(R[1, 0], R[0, 0]),
        ]
    )


def position_and_quaternion(T: Array) -> list[str]:
    """x y z qx qy qz qw of a pose (4, 4), each so that it is read back to the last bit."""
    return [repr(float(value)) for value in (*T[:3, 3], *quaternion(T[:3, :3]))]


def _matrix(T: Array) -> str:
    return "\n".join(_words(row) for row in T)


def _quaternion(T: Array) -> str:
    return " ".join(position_and_quaternion(T))


def _ros_tf(T: Array) -> str:
    names = ("x", "y", "z", "qx", "qy", "qz", "qw")
    values = position_and_quaternion(T)
    numbers = " ".join(f"--{name} {value}" for name, value in zip(names, values, strict=True))
    return f"ros2 run tf2_ros static_transform_publisher {numbers} --frame-id target --child-frame-id source"


def _urdf(T: Array) -> str:
    return f'<origin xyz="{_words(T[:3, 3])}" rpy="{_words(roll_pitch_yaw(T[:3, :3]))}"/>'


def _kitti(T: Array) -> str:
    return _words(T[:3].ravel())


def _tum(T: Array) -> str:
    return f"0.0 {_quaternion(T)}"


def _words(values: object) -> str:
    return " ".join(repr(float(value)) for value in np.ravel(np.asarray(values, dtype=np.float64)))


FORMATS: dict[str, Callable[[Array], str]] = {
    "matrix": _matrix,
    "quaternion": _quaternion,
    "ros-tf": _ros_tf,
    "urdf": _urdf,
    "cloudcompare": _matrix,
    "kitti": _kitti,
    "tum": _tum,
}
"""How each format writes a pose that maps source points to target points.

matrix : four lines of four numbers, as `numpy.loadtxt` reads
quaternion : x y z qx qy qz qw
ros-tf : the command that publishes the source's frame in the target's
urdf : the <origin> of a joint from the target's link to the source's, its angles about fixed axes
cloudcompare : the matrix that Edit > Apply transformation, and -APPLY_TRANS, take for the source
kitti : the first three rows in one line
tum : time (0), x y z qx qy qz qw
"""


def pose_text(T: Array, form: str) -> str:
    """A pose (4, 4) in one of `FORMATS`, every number so that it is read back to the last bit.

    Raises
    ------
    ValueError
        Another format; the message lists them.
    """
    if form not in FORMATS:
        raise ValueError(f"format={form!r}: a pose is written as {', '.join(FORMATS)}")
    return FORMATS[form](np.asarray(T, dtype=np.float64))
