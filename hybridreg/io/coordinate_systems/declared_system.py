# SPDX-License-Identifier: MIT
"""The coordinate reference system that an object of another library declares for the points that it holds."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from hybridreg.io.coordinate_systems.length_unit import LengthUnit
from hybridreg.io.coordinate_systems.proj_json import unit_of_system
from hybridreg.io.coordinate_systems.well_known_text import unit_of_text

PROJECT = "project them to metres first, for example with pyproj to UTM"
"""What to do with points in degrees that are in hand."""

# Of lazpy's readers and most others; of occulus' clouds, in their `metadata`.
_CALLED = ("crs", "coordinate_system")
_SYSTEM = re.compile(r"\s*(?:EPSG|OGC):\w+\s*|.*\[.*", re.IGNORECASE | re.DOTALL)


def unit_declared(x: Any) -> LengthUnit | None:
    """The unit of the system that `x`, or its metadata, declares; None where it declares none that can be read.

    A system is one of pyproj or rasterio, well-known text, or a code of EPSG with its name or as a number. Other words,
    such as the frame of a robot, say nothing about a unit.
    """
    if hasattr(getattr(x, "header", None), "vlrs"):  # laspy's, which are read by their records
        return None
    for held in (x, getattr(x, "metadata", None)):
        for called in _CALLED:
            unit = _unit(held.get(called) if isinstance(held, Mapping) else getattr(held, called, None))
            if unit is not None:
                return unit
    return None


def _unit(system: Any) -> LengthUnit | None:
    for tells, unit_of in (("to_json_dict", unit_of_system), ("to_wkt", unit_of_text)):
        tell = getattr(system, tells, None)
        if callable(tell):
            return unit_of(tell())
    if isinstance(system, int) and not isinstance(system, bool) and system > 0:
        return unit_of_system(f"EPSG:{system}")
    return unit_of_system(system) if isinstance(system, str) and _SYSTEM.fullmatch(system) else None
