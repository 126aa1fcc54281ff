# SPDX-License-Identifier: MIT
"""The unit that GeoTIFF's keys give a coordinate reference system, as LAS files up to 1.3 have them."""

from __future__ import annotations

from collections.abc import Mapping

from hybridreg.io.coordinate_systems.epsg_lengths import epsg_length
from hybridreg.io.coordinate_systems.length_unit import LengthUnit

# EPSG's codes of units of length, and the metres of one.
_LENGTHS = {9001: 1.0, 9002: 0.3048, 9003: 1200 / 3937, 9036: 1000.0, 1025: 1e-3, 1033: 1e-2}
_OWN = 32767  # a system or a unit that is no code of EPSG's
_MODEL, _GEOGRAPHIC = 1024, 2  # GTModelTypeGeoKey, and its ModelTypeGeographic
_DEGREES = 2048  # GeographicTypeGeoKey: the system itself, or the one beneath a projected system
_ACROSS, _ACROSS_UNIT = 3072, 3076  # ProjectedCSTypeGeoKey, ProjLinearUnitsGeoKey
_MERCATOR = (3857, 3785, 3395, 54004)  # EPSG's for web maps, now and before, and for the world; Esri's
_UP, _UP_UNIT = 4096, 4099  # VerticalCSTypeGeoKey, VerticalUnitsGeoKey


def unit_of_keys(keys: Mapping[int, int]) -> LengthUnit:
    """What the keys' values say; metres where they name neither a system nor a unit.

    Source: OGC 19-008r4 (GeoTIFF), section 7. A unit that is given counts before the system's own.
    """
    projected = _ACROSS in keys or _ACROSS_UNIT in keys
    if keys.get(_MODEL) == _GEOGRAPHIC or (_MODEL not in keys and _DEGREES in keys and not projected):
        return LengthUnit(up=_length(keys, _UP, _UP_UNIT)[0] or 1.0, degrees=True)
    across, unknown = _length(keys, _ACROSS, _ACROSS_UNIT)
    up, unknown_up = _length(keys, _UP, _UP_UNIT)
    metres = across or 1.0
    return LengthUnit(
        metres, up or metres, unknown=unknown or unknown_up, stretched=keys.get(_ACROSS) in _MERCATOR
    )


def _length(keys: Mapping[int, int], system: int, unit: int) -> tuple[float | None, str]:
    """Metres, None where nothing is said or known; and in words what is said and not known."""
    if unit in keys:
        metres, words = _LENGTHS.get(keys[unit]), f"unit {_told(keys[unit])}"
    elif system in keys:
        metres, words = epsg_length(keys[system]), _told(keys[system])
    else:
        return None, ""
    return metres, "" if metres else words


def _told(code: int) -> str:
    return "defined by its writer" if code == _OWN else f"EPSG:{code}"
