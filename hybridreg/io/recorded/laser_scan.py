# SPDX-License-Identifier: MIT
"""ROS's sensor_msgs/LaserScan, of a 2-D laser scanner, without ROS: any object or dictionary with its fields."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault

Array = NDArray[np.float64]
_HAS = ("angle_min", "angle_increment", "range_min", "range_max", "ranges")


def is_scan(x: Any) -> bool:
    """Whether an object, or a dictionary, has the fields of a LaserScan."""
    return all(each in x if isinstance(x, Mapping) else hasattr(x, each) for each in _HAS)


def points(message: Any, name: str) -> Array:
    """x, y and z = 0 in the scanner's frame, metres, shape (N, 3); NaN where nothing came back.

    Source: the comments of sensor_msgs/LaserScan: beam k points to `angle_min + k * angle_increment` (radians from x
    towards y), and ranges below `range_min` or above `range_max` are to be discarded.

    Raises
    ------
    ValueError
        Its ranges are no row of numbers, as those of a scanner with several echoes.
    """
    scan = SimpleNamespace(**message) if isinstance(message, Mapping) else message
    try:
        ranges = np.array(scan.ranges, dtype=np.float64)  # null in JSON, which has no infinity, is NaN
    except (TypeError, ValueError) as error:
        raise fault(
            name, "the ranges of a LaserScan are no numbers", "give the first echo of each beam"
        ) from error
    if ranges.ndim != 1:
        raise fault(name, f"the ranges of a LaserScan have the shape {ranges.shape}", "give one row of them")
    low, high = float(scan.range_min), float(scan.range_max)
    seen = (ranges >= low) & (ranges <= high if high > low else np.isfinite(ranges))
    ranges[~seen] = np.nan
    angles = float(scan.angle_min) + float(scan.angle_increment) * np.arange(len(ranges))
    flat = np.zeros(len(ranges))
    flat[~seen] = np.nan
    return np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles), flat])
