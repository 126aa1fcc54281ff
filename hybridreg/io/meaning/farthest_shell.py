# SPDX-License-Identifier: MIT
"""The sphere around the sensor on which simulators put the ends of rays that met nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_FEWEST, _LEAST = 20, 0.01  # points of the shell, and their share
_MOST = 0.95  # share from which the sphere is the thing that was seen
_SAME = 3e-4  # of a range, by which two that are the same may differ: digits of a text, single precision
_OTHERS = 5  # how many times as many as on any other range: rings on flat ground, radars
_THIN = 0.01  # of the range; a shell thinner than that is a ring on the ground


def farthest_shell(points: Array) -> tuple[float, NDArray[np.bool_]] | None:
    """The longest distance of finite points (N, 3) from the origin, and which of them have it; None where few do.

    The ends of rays that met nothing lie there, at the sensor's reach, in all directions.
    """
    if len(points) < _FEWEST:
        return None
    with np.errstate(over="ignore"):
        ranges = np.sqrt(np.einsum("ij,ij->i", points, points))
    reach = float(ranges.max())
    if not np.isfinite(reach):
        return None
    there = ranges >= (1.0 - _SAME) * reach
    count = int(np.count_nonzero(there))
    if count < max(_FEWEST, _LEAST * len(points)) or count > _MOST * len(points):
        return None
    nearer = np.sort(ranges[~there])
    if nearer[0] > 0.5 * reach:  # the origin is no sensor's
        return None
    several = count // _OTHERS
    if (nearer[several:] - nearer[: len(nearer) - several] <= _SAME * nearer[several:]).any():
        return None
    shell = points[there] - points[there].mean(axis=0)
    if np.linalg.eigvalsh(shell.T @ shell / count)[0] < (_THIN * reach) ** 2:
        return None
    return float(np.median(ranges[there])), there
