# SPDX-License-Identifier: MIT
"""The coordinate reference system of a table's points, as GeoParquet and GeoArrow keep it beside their column."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from hybridreg.io.coordinate_systems.length_unit import LengthUnit
from hybridreg.io.coordinate_systems.proj_json import unit_of_system

_EXTENSION = b"ARROW:extension:metadata"


def unit_of_schema(schema: Any) -> LengthUnit | None:
    """The unit of the points of a table with that schema of pyarrow; None where it has no column of geometries.

    Source: GeoParquet 1.1, where a column without a system is in degrees and one whose system is null in anything; and
    GeoArrow 0.2, where one without is in anything.
    """
    if {"x", "y", "z"} <= {each.lower() for each in schema.names}:
        return None
    told = _parsed((schema.metadata or {}).get(b"geo"))
    columns = told.get("columns")
    column = columns.get(told.get("primary_column")) if isinstance(columns, Mapping) else None
    if isinstance(column, Mapping):
        return unit_of_system(column.get("crs", "OGC:CRS84"))
    for field in schema:
        beside = _parsed((field.metadata or {}).get(_EXTENSION))
        if beside.get("crs"):
            return unit_of_system(beside["crs"])
    return None


def coordinates_of(x: str, unit: LengthUnit) -> str:
    """The Python that gives x, y and z in metres of geopandas' frame `x`, whose system has that unit."""
    moved = f"{x}.to_crs({x}.estimate_utm_crs())" if unit.degrees or unit.stretched else x
    across = unit.across if moved == x else 1.0  # heights stay as they are
    metres = (across, across, unit.up)
    factor = "" if set(metres) == {1.0} else f" * {[float(f'{each:.9g}') for each in metres]}"
    return f"{moved}.get_coordinates(include_z=True){factor}"


def unit_of_frame(frame: Any) -> LengthUnit:
    """The unit of geopandas' frame by its `crs`; metres where it has none."""
    tell = getattr(getattr(frame, "crs", None), "to_json_dict", None)
    return unit_of_system(tell()) if callable(tell) else LengthUnit()


def _parsed(text: bytes | None) -> Mapping[str, Any]:
    try:
        found = json.loads(text) if text else {}
    except (ValueError, RecursionError):  # of no use, and nothing beside the points depends on it
        return {}
    return found if isinstance(found, Mapping) else {}
