# SPDX-License-Identifier: MIT
"""Azimuth, elevation and range where x, y and z are expected: refused by their names, told by their values."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, shorten
from hybridreg.io.meaning.first_column import FEWEST, looked_at

Array = NDArray[np.float64]

_AFFIX = r"(?:[ _]?(?:deg|degrees?|rad|radians?|m|metres?|meters?|mm|\d))?"
_RANGE = re.compile(rf"(?:spherical)?(?:ranges?|r|rho|dist(?:ance)?s?|radius){_AFFIX}")
_ANGLE = re.compile(
    rf"(?:spherical)?(?:azim(?:uth)?s?|azimut|az|elev(?:ation)?s?|el|theta|phi|inclination|zenith|bearing|pan|tilt|hz|"
    rf"(?:horizontal|vertical)[ _]angle|angle){_AFFIX}"
)
# As `aer2enu` of pymap3d 3.2.0 has it: by the other formulas the cloud is its mirror image.
_CLOCKWISE = (
    "where the azimuth counts clockwise, as of compasses, Velodyne's sensors and radars, "
    "the first two change places"
)
_CURE = (
    "convert them to x, y and z: range cos(elevation) cos(azimuth), range cos(elevation) sin(azimuth), "
    f"range sin(elevation); {_CLOCKWISE}; an elevation is 90 degrees less the angle from the zenith"
)
_CURE_BESIDE_Z = f"convert them to x, y and z: range cos(azimuth), range sin(azimuth), z; {_CLOCKWISE}"
_ORDERS = ((0, 1, 2), (1, 2, 0), (1, 0, 2), (2, 1, 0))  # azimuth, elevation, range
_NEARLY = 0.985  # of a turn
_MOST_BEAMS = 128
_AT_THE_END = 0.02  # radians by which the first and the last of azimuths around may lie within half a turn


def refuse_spherical(names: Iterable[str], name: str) -> None:
    """Refuse columns, none of them x, that are called angles and a range.

    Raises
    ------
    ValueError
        They are; it says how x, y and z follow from them.
    """
    held = [str(each).strip(" \"'") for each in names]
    parts = [re.split(r"\s*[\[(/]", each.lower())[0] for each in held]
    if any(map(_RANGE.fullmatch, parts)) and any(map(_ANGLE.fullmatch, parts)):
        problem = f"its columns {shorten(', '.join(held), 200)} are angles and ranges, not coordinates"
        raise fault(name, problem, _CURE_BESIDE_Z if "z" in parts else _CURE)


def tell_spherical(rows: NDArray[Any], name: str) -> None:
    """Warn where the first three columns of a table without names (N, 3+) look like azimuth, elevation and range: one
    goes once around, one takes the few values of a sensor's beams, and one is never negative."""
    if len(rows) < FEWEST or rows.shape[1] < 3:
        return
    with np.errstate(over="ignore", invalid="ignore"):
        some = np.asarray(np.ma.filled(rows[looked_at(len(rows)), :3].astype(np.float64), np.nan))
    some = some[np.isfinite(some).all(axis=1)]
    if len(some) < FEWEST:
        return
    for order in _ORDERS:
        azimuth, elevation, distance = some[:, order].T
        if distance.min() >= 0.0 and distance.max() > 0.0 and _turn(azimuth, elevation):
            where = ", ".join(("x", "y", "z")[k] for k in order)
            warnings.warn(
                f"{name}: its first three columns were read as x, y and z, and {where} look like azimuth, elevation "
                f"and range; if they are, {_CURE}",
                UserWarning,
                stacklevel=4,
            )
            return


def _turn(azimuth: Array, elevation: Array) -> bool:
    if np.abs(elevation).max() <= np.pi / 2 and np.ptp(elevation) > 0.0 and _in_radians(azimuth):
        return True
    kinds = len(np.unique(elevation))
    if not 1 < kinds <= min(_MOST_BEAMS, len(elevation) / 5) or len(np.unique(azimuth)) < 3 * kinds:
        return False
    if np.mean(azimuth == np.round(azimuth)) > 0.5:  # a grid's
        return False
    for turn in (360.0, 2.0 * np.pi):
        around = azimuth.max() - azimuth.min() >= _NEARLY * turn
        low, high = azimuth.min() / turn, azimuth.max() / turn
        inside = (low >= 0.0 and high <= 1.0001) or (low >= -0.5001 and high <= 0.5001)
        if around and inside and np.abs(elevation).max() <= turn / 4:
            return True
    return False


def _in_radians(azimuth: Array) -> bool:
    # So near to pi at both ends that the elevations need not be those of beams, as they are not after noise.
    within = 0.0 <= np.pi - azimuth.max() <= _AT_THE_END and 0.0 <= np.pi + azimuth.min() <= _AT_THE_END
    return bool(within and len(np.unique(azimuth)) > len(azimuth) / 2)
