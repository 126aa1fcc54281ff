# SPDX-License-Identifier: MIT
"""ROS's sensor_msgs/PointCloud2 without ROS: any object with its fields."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.arrays import array_points
from hybridreg.io.faults import fault

Array = NDArray[np.float64]

_HAS = ("fields", "point_step", "row_step", "width", "height", "data")
# sensor_msgs/PointField's datatypes.
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


def is_cloud(x: Any) -> bool:
    """Whether an object has the fields of a PointCloud2."""
    return all(hasattr(x, each) for each in _HAS)


def points(message: Any, name: str) -> Array:
    """x, y and z of a PointCloud2, its padding left out; shape (N, 3).

    Raises
    ------
    ValueError
        The message holds fewer bytes than it promises, or no fields x, y and z.
    """
    order = ">" if message.is_bigendian else "<"
    fields = [f for f in message.fields if f.datatype in _TYPES]
    layout: Any = {
        "names": [f.name for f in fields],
        "formats": [order + _TYPES[f.datatype] for f in fields],
        "offsets": [f.offset for f in fields],
        "itemsize": message.point_step,
    }
    raw = message.data
    data = (
        np.frombuffer(raw, np.uint8)
        if isinstance(raw, (bytes, bytearray, memoryview))
        else np.asarray(raw, np.uint8)
    )
    rows, columns = int(message.height), int(message.width)
    step = int(message.row_step) or columns * int(message.point_step)
    if rows * columns == 0:
        return np.empty((0, 3))
    if (rows - 1) * step + columns * int(message.point_step) > data.size:
        problem = f"a PointCloud2 of {rows} x {columns} points of {message.point_step} bytes holds {data.size} bytes"
        raise fault(name, problem, "take the message again")
    try:
        record = np.dtype(layout)
    except ValueError as error:
        raise fault(
            name, f"the fields of a PointCloud2 cannot be ({error})", "take the message again"
        ) from error
    strides = (step, int(message.point_step))
    return array_points(
        np.ndarray((rows, columns), record, np.ascontiguousarray(data), 0, strides).ravel(), name
    )
