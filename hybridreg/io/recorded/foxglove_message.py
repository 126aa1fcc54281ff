# SPDX-License-Identifier: MIT
"""Foxglove's message `foxglove.PointCloud`, of protobuf or of JSON: an object with its fields."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from hybridreg.io.faults import fault
from hybridreg.io.recorded import ros_messages

Array = NDArray[np.float64]
# foxglove.PackedElementField's types as sensor_msgs/PointField's.
_AS_ROS = {1: 2, 2: 1, 3: 4, 4: 3, 5: 6, 6: 5, 7: 7, 8: 8}


def of_json(data: bytes) -> Any:
    """The message in a text of JSON, its `data` in base64 still; what was left out is zero, as in protobuf."""
    told = json.loads(data)
    pose = told.get("pose") or {}
    return SimpleNamespace(
        data=told.get("data", ""),
        point_stride=told.get("point_stride", 0),
        fields=[
            SimpleNamespace(
                name=f.get("name", ""), offset=int(f.get("offset", 0)), type=int(f.get("type", 0))
            )
            for f in told.get("fields", [])
        ],
        pose=SimpleNamespace(
            position=_numbers(pose.get("position"), "xyz"),
            orientation=_numbers(pose.get("orientation"), "xyzw"),
        ),
    )


def _numbers(told: Any, names: str) -> SimpleNamespace:
    return SimpleNamespace(**{each: float((told or {}).get(each, 0.0)) for each in names})


def points(message: Any, name: str) -> Array:
    """x, y and z (N, 3) as the message holds them, before its pose.

    Raises
    ------
    ValueError
        Its bytes are no whole number of points, or as `ros_messages.points`.
    """
    data = ros_messages.as_bytes(message.data, name)
    stride = int(message.point_stride)
    if stride < 1 or data.size % stride:
        problem = f"a foxglove.PointCloud of {data.size} bytes has points of {stride}"
        raise fault(name, problem, "take the message again")
    as_ros = SimpleNamespace(
        fields=[
            SimpleNamespace(name=f.name, offset=f.offset, datatype=_AS_ROS.get(f.type, 0))
            for f in message.fields
        ],
        is_bigendian=False,
        point_step=stride,
        row_step=0,
        height=1,
        width=data.size // stride,
        data=data,
    )
    return ros_messages.points(as_ros, name)


def pose(message: Any) -> tuple[Array, Array]:
    """Rotation (3, 3) and position (3,) of the message; the identity where none was set: zeros are no rotation."""
    p, q = message.pose.position, message.pose.orientation
    turn = np.array([q.x, q.y, q.z, q.w])
    R = Rotation.from_quat(turn).as_matrix() if turn.any() else np.eye(3)
    return R, np.array([p.x, p.y, p.z])
