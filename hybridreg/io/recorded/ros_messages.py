# SPDX-License-Identifier: MIT
"""Clouds of ROS without ROS, sensor_msgs/PointCloud2, PointCloud and LaserScan: any object or dictionary with their
fields."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.arrays import TOGETHER, array_points
from hybridreg.io.column_names import axes_in
from hybridreg.io.faults import fault, shorten
from hybridreg.io.recorded import laser_scan

Array = NDArray[np.float64]

_HAS = ("fields", "point_step", "row_step", "width", "height", "data")
# sensor_msgs/PointField's datatypes.
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}


FLAT = "sensor_msgs/msg/LaserScan"
KINDS = ("sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/PointCloud", FLAT)
"""What ROS 2 calls them."""


def is_cloud(x: Any) -> bool:
    """Whether an object, or a dictionary, has the fields of a PointCloud2 or a LaserScan."""
    held = all(each in x if isinstance(x, Mapping) else hasattr(x, each) for each in _HAS)
    return held or laser_scan.is_scan(x)


def points(message: Any, name: str) -> Array:
    """x, y and z of a cloud, its padding and its other fields left out; shape (N, 3).

    A dictionary is read as `json` makes it of what rosbridge sends, its `data` in base64.

    Raises
    ------
    ValueError
        The message holds fewer bytes than it promises, or no fields x, y and z; or as `laser_scan.points`.
    """
    if laser_scan.is_scan(message):
        return laser_scan.points(message, name)
    message = _object(message)
    if not hasattr(message, "point_step"):  # a PointCloud, the older message
        return np.array([(each.x, each.y, each.z) for each in message.points], dtype=np.float64).reshape(
            -1, 3
        )
    rows, columns, size = int(message.height), int(message.width), int(message.point_step)
    if rows * columns == 0:
        return np.empty((0, 3))
    data = as_bytes(message.data, name)
    step = _row_step(message, data, name)
    record = _record(message, name)
    return array_points(np.ndarray((rows, columns), record, data, 0, (step, size)).ravel(), name)


def _object(message: Any) -> Any:
    if not isinstance(message, Mapping):
        return message
    fields = [SimpleNamespace(**each) if isinstance(each, Mapping) else each for each in message["fields"]]
    return SimpleNamespace(**{"is_bigendian": False, **message, "fields": fields})


def as_bytes(raw: Any, name: str) -> NDArray[np.uint8]:
    """The data of a message as numbers; text is base64, as JSON has it.

    Raises
    ------
    ValueError
        Text that is no base64.
    """
    if isinstance(raw, str):
        try:
            raw = base64.b64decode(raw, validate=True)
        except (binascii.Error, ValueError) as error:
            problem = f"the data of a cloud are text, but not base64: {shorten(raw)}"
            raise fault(name, problem, "give them as bytes") from error
    if isinstance(raw, (bytes, bytearray, memoryview)):
        return np.frombuffer(raw, np.uint8)
    return np.ascontiguousarray(np.asarray(raw, np.uint8))


def _row_step(message: Any, data: NDArray[np.uint8], name: str) -> int:
    rows, packed = int(message.height), int(message.width) * int(message.point_step)
    step = int(message.row_step) or packed
    if (rows - 1) * step + packed <= data.size:
        return step
    if data.size == rows * packed:  # complete: a driver wrote the size of all rows for that of one
        return packed
    problem = f"a PointCloud2 of {rows} x {message.width} points of {message.point_step} bytes holds {data.size} bytes"
    raise fault(name, problem, "take the message again")


def _record(message: Any, name: str) -> np.dtype[Any]:
    """The type of one point with its coordinates alone: other fields may share a name, or have none."""
    order = ">" if message.is_bigendian else "<"
    fields = [field for field in message.fields if field.datatype in _TYPES]
    names = [str(field.name) for field in fields]
    lowered = [each.lower() for each in names]
    together = [
        k for k, field in enumerate(fields) if lowered[k] in TOGETHER and getattr(field, "count", 1) == 3
    ]
    alone = bool(together) and "x" not in lowered
    chosen = together[:1] if alone else axes_in(names, name).columns
    layout: Any = {
        "names": [names[k] for k in chosen],
        "formats": [("3" if alone else "") + order + _TYPES[fields[k].datatype] for k in chosen],
        "offsets": [fields[k].offset for k in chosen],
        "itemsize": message.point_step,
    }
    try:
        return np.dtype(layout)
    except ValueError as error:
        problem = f"the fields of a PointCloud2 cannot be ({error})"
        raise fault(name, problem, "correct their offsets, or its point_step") from error
