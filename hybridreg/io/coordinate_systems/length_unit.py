# SPDX-License-Identifier: MIT
"""The unit of a cloud's points, and the points in metres."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


_EARTH = 6_378_137.0  # metres, of WGS 84's equator
# From where a stretch is told: a tenth of a metre in a hundred; and that of the poles, where Mercator's map ends.
_LEAST, _MOST = 1.001, 12.0


class LengthUnit(NamedTuple):
    """Metres of one unit across (x, y) and up (z); whether x and y are degrees; which system gives no unit that is
    known here, in words, "" where each does; and whether its metres are right along the equator alone (Mercator)."""

    across: float = 1.0
    up: float = 1.0
    degrees: bool = False
    unknown: str = ""
    stretched: bool = False


def tell_stretch(points: Array, unit: LengthUnit, name: str) -> None:
    """Warn where x and y (N, 3) are Mercator's, stretched by the secant of the latitude, and z is not."""
    if not unit.stretched or not len(points):
        return
    with np.errstate(over="ignore"):
        factor = float(np.cosh(np.median(points[:, 1]) / _EARTH))
    if _LEAST < factor < _MOST:
        warnings.warn(
            f"{name}: its coordinate system is Mercator's, as web maps have it, which stretches x and y by "
            f"{factor:.4g} there, and heights not at all; project it to metres first, for example with PDAL's "
            "filters.reprojection to UTM",
            UserWarning,
            stacklevel=4,
        )


def in_metres(points: Array, metres: float | None, name: str, *, up: float | None = None) -> Array:
    """Points (N, 3) whose unit has so many metres, that of z perhaps another, `up`; in metres. None leaves them.

    Warns where that changes them, since their pose will be in metres too.
    """
    across = 1.0 if metres is None else metres
    up = across if up is None else up
    if across == up == 1.0:
        return points
    unit = f"{across:.6g} m" if across == up else f"{across:.6g} m across and {up:.6g} m up"
    warnings.warn(
        f"{name}: its own header says that its unit is {unit}; it was read in metres, and the pose is in metres too",
        UserWarning,
        stacklevel=3,
    )
    return points * (across, across, up)
