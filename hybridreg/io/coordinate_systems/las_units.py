# SPDX-License-Identifier: MIT
"""A LAS file's points in metres, by the coordinate reference system of its records."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.coordinate_systems.geo_keys import unit_of_keys
from hybridreg.io.coordinate_systems.length_unit import LengthUnit, in_metres, tell_stretch
from hybridreg.io.coordinate_systems.well_known_text import unit_of_text
from hybridreg.io.faults import fault

Array = NDArray[np.float64]

_PROJECT = "project them to metres first, for example with PDAL's filters.reprojection"

WELL_KNOWN_TEXT = 2112
"""The id of the record that holds a system's well-known text."""


def metres_of_las(points: Array, records: Iterable[Any], name: str) -> Array:
    """The points (N, 3) of a LAS file with those variable length records (laspy's), in metres.

    Raises
    ------
    ValueError
        x and y are longitude and latitude.
    """
    return metres_of_system(points, told(records), name)


def metres_of_system(points: Array, unit: LengthUnit, name: str, project: str = _PROJECT) -> Array:
    """The points (N, 3) of a coordinate reference system with that unit, in metres; `project`: how degrees are left.

    Raises
    ------
    ValueError
        x and y are longitude and latitude.
    """
    if unit.degrees and len(points):
        _check_degrees(points, name, project + _of_heights(unit.up))
        return points
    if unit.unknown:
        _warn(
            f"{name}: its coordinate system, {unit.unknown}, gives no unit that is known here; what it does not give "
            "was taken for metres: convert it to metres first where it is in feet"
        )
    tell_stretch(points, unit, name)
    return in_metres(points, unit.across, name, up=unit.up)


def told(records: Iterable[Any]) -> LengthUnit:
    """The unit that the records of a header give; metres where none tells of a coordinate system."""
    for record in records:
        keys, text = getattr(record, "geo_keys", None), getattr(record, "string", None)
        if (
            getattr(record, "record_id", None) == WELL_KNOWN_TEXT
            and isinstance(text, str)
            and text.strip("\0 ")
        ):
            return unit_of_text(text)
        if keys is not None:
            # A value that is stored elsewhere has a tag; those read here never are.
            unit = unit_of_keys({key.id: key.value_offset for key in keys if key.tiff_tag_location == 0})
            if unit != LengthUnit():  # the keys may be empty, and another record tell
                return unit
    return LengthUnit()


def _of_heights(metres: float) -> str:
    if metres == 1.0:
        return ""
    return (
        f"; its heights are in units of {metres:.9g} m, and stay so where x and y alone are projected: multiply them "
        "by it"
    )


def _check_degrees(points: Array, name: str, project: str) -> None:
    # A geographic system on projected coordinates is a common slip.
    if (np.abs(points[:, :2]).max(axis=0) <= (360.0, 90.0)).all():
        raise fault(name, "its x and y are longitude and latitude in degrees", project)
    _warn(
        f"{name}: its header says longitude and latitude, its x and y cannot be; they were taken for metres"
    )


def _warn(words: str) -> None:
    warnings.warn(words, UserWarning, stacklevel=4)
