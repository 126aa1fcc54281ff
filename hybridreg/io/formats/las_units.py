# SPDX-License-Identifier: MIT
"""The unit of a LAS file's coordinates, from its coordinate reference system."""

from __future__ import annotations

import re
import warnings
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault

Array = NDArray[np.float64]

_FOOT = 0.3048  # metres, by definition
_SURVEY_FOOT = 1200 / 3937  # metres, by definition
# EPSG's codes of lengths, and the GeoTIFF keys that hold one: of x and y, of z; the key of the kind of system.
_LENGTHS = {9001: 1.0, 9002: _FOOT, 9003: _SURVEY_FOOT}
_ACROSS = 3076  # ProjLinearUnitsGeoKey
_UP = 4099  # VerticalUnitsGeoKey
_MODEL = 1024  # GTModelTypeGeoKey
_GEOGRAPHIC = 2  # ModelTypeGeographic
_UNIT = re.compile(r'UNIT\s*\[\s*"[^"]*"\s*,\s*([0-9.eE+-]+)')


class Unit(NamedTuple):
    """Metres of one unit across (x, y) and up (z); whether x and y are degrees."""

    across: float = 1.0
    up: float = 1.0
    degrees: bool = False


def in_metres(points: Array, records: Any, name: str) -> Array:
    """The points (N, 3) of a LAS file with those variable length records (laspy's), in metres.

    Raises
    ------
    ValueError
        x and y are longitude and latitude.
    """
    unit = told(records)
    if unit.degrees and len(points) and (np.abs(points[:, :2]).max(axis=0) <= (360.0, 90.0)).all():
        cure = "project them to metres first, for example with PDAL's filters.reprojection"
        raise fault(name, "its x and y are longitude and latitude in degrees", cure)
    if unit.across == 1.0 and unit.up == 1.0:
        return points
    warnings.warn(
        f"{name}: its header says that its unit is {unit.across:.6g} m across and {unit.up:.6g} m up; it was read in "
        "metres, and the pose is in metres too",
        UserWarning,
        stacklevel=3,
    )
    return points * (unit.across, unit.across, unit.up)


def told(records: Any) -> Unit:
    """The unit that the records of a header give; metres where they give none that is understood."""
    for record in records:
        keys, text = getattr(record, "geo_keys", None), getattr(record, "string", None)
        if getattr(record, "record_id", None) == 2112 and isinstance(text, str) and text.strip("\0 "):
            return _of_text(text)
        if keys is not None:
            # A value that is stored elsewhere has a tag; those read here never are.
            values = {key.id: key.value_offset for key in keys if key.tiff_tag_location == 0}
            across = _LENGTHS.get(values.get(_ACROSS, 9001), 1.0)
            up = _LENGTHS.get(values.get(_UP, 9001), 1.0) if _UP in values else across
            return Unit(across, up, values.get(_MODEL) == _GEOGRAPHIC)
    return Unit()


def _of_text(text: str) -> Unit:
    # WKT 1, which LAS 1.4 asks for: the unit of a system stands after its parts, so that the last length counts.
    level, _, height = text.partition("VERT_CS")
    if "PROJCS" not in level:
        return Unit(degrees="GEOGCS" in level)
    across, up = _length(level), _length(height) if height else None
    return Unit(across or 1.0, up or across or 1.0)


def _length(text: str) -> float | None:
    # A degree is 0.0175 rad; no unit of length in use is that short.
    factors = [float(each) for each in _UNIT.findall(text) if re.fullmatch(r"\d*\.?\d+([eE][+-]?\d+)?", each)]
    lengths = [factor for factor in factors if 0.1 < factor < 10.0]
    return lengths[-1] if lengths else None
