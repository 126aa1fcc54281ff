# SPDX-License-Identifier: MIT
"""The unit that PROJJSON, in which GeoParquet and GeoArrow keep it, gives a coordinate reference system."""

from __future__ import annotations

import math
import re
from typing import Any

from hybridreg.io.coordinate_systems.epsg_lengths import epsg_length
from hybridreg.io.coordinate_systems.length_unit import LengthUnit
from hybridreg.io.coordinate_systems.well_known_text import unit_of_text
from hybridreg.io.faults import shorten

_MERCATOR = re.compile(r"(popular visualisation pseudo )?mercator")
_CODE = re.compile(r"(EPSG|OGC):(\w+)", re.IGNORECASE)
# Systems in degrees that files name by a code alone.
_DEGREES = ("CRS84", "CRS84H", "CRS83", "4326", "4979", "4258", "4937", "4269", "6318", "6319", "9000")


def unit_of_system(system: Any) -> LengthUnit:
    """What a system says as PROJJSON, as a code (`EPSG:2263`) or as well-known text; metres where there is none.

    Source: PROJJSON 0.7. The axes' own units count.
    """
    if isinstance(system, str):
        return _of_code(system) if _CODE.fullmatch(system.strip()) else unit_of_text(system)
    if not isinstance(system, dict):
        return LengthUnit()
    parts = system.get("components")  # of a compound: one across, one upright
    across, *others = parts if isinstance(parts, list) and parts else [system]
    across = _inner(across)
    axes = _axes(across)
    upright = axes[2:] or [unit for each in others for unit in _axes(_inner(each))]
    if _subtype(across) == "ellipsoidal":
        return LengthUnit(up=(upright and upright[0]) or 1.0, degrees=True)
    unknown = "" if axes and None not in (axes[0], *upright[:1]) else shorten(str(system.get("name")))
    metres = axes[0] if axes and axes[0] else 1.0
    up = upright[0] if upright and upright[0] else metres
    return LengthUnit(metres, up, unknown=unknown, stretched=_is_mercator(across))


def _of_code(text: str) -> LengthUnit:
    code = text.strip().split(":")[1].upper()
    if code in _DEGREES:
        return LengthUnit(degrees=True)
    metres = epsg_length(int(code)) if code.isdecimal() else None
    return LengthUnit(metres or 1.0, metres or 1.0, unknown="" if metres else shorten(text.strip()))


def _inner(system: Any) -> dict[str, Any]:
    # A bound system is one with a way to another beside it.
    for _ in range(3):
        if isinstance(system, dict) and "source_crs" in system:
            system = system["source_crs"]
    return system if isinstance(system, dict) else {}


def _system(system: dict[str, Any]) -> dict[str, Any]:
    found = system.get("coordinate_system")
    return found if isinstance(found, dict) else {}


def _subtype(system: dict[str, Any]) -> str:
    return str(_system(system).get("subtype")).lower()


def _axes(system: dict[str, Any]) -> list[float | None]:
    """Metres of the unit of each axis; None where it is none of length that is known."""
    axes = _system(system).get("axis")
    return [_metres(each.get("unit")) for each in axes if isinstance(each, dict)] if axes else []


def _metres(unit: Any) -> float | None:
    if unit == "metre":
        return 1.0
    factor = unit.get("conversion_factor") if isinstance(unit, dict) else None
    right = isinstance(factor, (int, float)) and math.isfinite(factor) and factor > 0.0
    return float(factor) if right and factor is not None else None


def _is_mercator(system: dict[str, Any]) -> bool:
    """Whether the projection is Mercator's with the scale of the equator, no transverse or oblique one."""
    conversion = system.get("conversion")
    method = conversion.get("method") if isinstance(conversion, dict) else None
    if not isinstance(conversion, dict) or not isinstance(method, dict):
        return False
    given = [each for each in conversion.get("parameters") or () if isinstance(each, dict)]
    values = {str(each.get("name")).lower(): each.get("value") for each in given}
    scaled = any(value not in (0, 1) for key, value in values.items() if "scale" in key)
    parallels = any(value for key, value in values.items() if "parallel" in key)
    return bool(_MERCATOR.match(str(method.get("name")).lower())) and not scaled and not parallels
