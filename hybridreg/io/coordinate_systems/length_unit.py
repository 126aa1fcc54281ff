# SPDX-License-Identifier: MIT
"""The unit of a cloud's points, and the points in metres."""

from __future__ import annotations

import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class LengthUnit(NamedTuple):
    """Metres of one unit across (x, y) and up (z); whether x and y are degrees; and which system gives no unit that is
    known here, in words, "" where each does."""

    across: float = 1.0
    up: float = 1.0
    degrees: bool = False
    unknown: str = ""


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
