# SPDX-License-Identifier: MIT
"""The unit that a file or an object gives for its coordinates, in words of many kinds."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.coordinate_systems.length_unit import LengthUnit, in_metres, tell_stretch
from hybridreg.io.coordinate_systems.well_known_text import unit_of_text
from hybridreg.io.faults import fault, shorten

Array = NDArray[np.float64]

# Without spaces, full stops and hyphens, which are put between the letters in every way.
_METRES = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 1e-3),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters"), 1e-2),
    **dict.fromkeys(("dm", "decimetre", "decimetres", "decimeter", "decimeters"), 1e-1),
    **dict.fromkeys(("km", "kilometre", "kilometres", "kilometer", "kilometers"), 1e3),
    **dict.fromkeys(
        ("um", "µm", "μm", "micrometre", "micrometres", "micrometer", "micrometers", "micron"), 1e-6
    ),
    **dict.fromkeys(("ft", "foot", "feet", "intlft", "internationalfoot", "internationalfeet"), 0.3048),
    **dict.fromkeys(("ftus", "usft", "usfoot", "usfeet", "sft", "surveyfoot", "surveyfeet"), 1200 / 3937),
    **dict.fromkeys(("ussurveyft", "ussurveyfoot", "ussurveyfeet"), 1200 / 3937),
    **dict.fromkeys(("in", "inch", "inches"), 0.0254),
}
ANGLES = ("deg", "degree", "degrees", "°", "rad", "radian", "radians")

_BETWEEN = re.compile(r"[\s._-]+")
_WORD = r"((?:u\.?s\.?|intl\.?|international)[ -]?(?:survey )?(?:ft|f[oe][oe]t)|[a-zµμ°]+)"
_SAYS = (
    re.compile(
        rf"(?:([a-z]+)[ _-]+)?(?<![a-z])units?\b\W*(?:(?:is|are|in)\b\W*){{0,2}}{_WORD}", re.IGNORECASE
    ),
    re.compile(
        rf"\b(coordinates?|xyz|positions?|lengths?|distances?)\b[\w ,]{{0,25}}\bin {_WORD}\b", re.IGNORECASE
    ),
    re.compile(rf"()\W*[\[(]\s*{_WORD}\s*[\])]\s*", re.IGNORECASE),
)
# Before "unit": what has an angle, where that is x, y and z; what has a length that is not theirs.
_OF_POINTS = ("", "the", "all", "xyz", "coordinate", "coordinates", "position", "positions")
_OF_OTHERS = (
    "range",
    "time",
    "intensity",
    "wavelength",
    "pulse",
    "beam",
    "accuracy",
    "noise",
    "error",
    "resolution",
)
_SYSTEM = re.compile(r'UNIT\s*\[\s*"')  # of a coordinate reference system
_SCALE = re.compile(r"\bscale(?:[ _]?factor)?\s*[:=]\s*([0-9.]+(?:e[+-]?\d+)?)\s*", re.IGNORECASE)
# Where objects say it: astropy, pint and trimesh; in dictionaries, as those of xarray, pandas, h5py and pyarrow.
_ATTRIBUTES = ("unit", "units")
_DICTIONARIES = ("attrs", "metadata")
_KEYS = ("unit", "units", "length_unit")


def unit_said(text: str, name: str) -> LengthUnit | None:
    """The unit that a comment such as `unit: mm` names for x, y and z; None where it names no known one.

    Raises
    ------
    ValueError
        The unit is an angle.
    """
    if _SYSTEM.search(text):
        return _of_system(text, name)
    for says in _SAYS:
        found = says.fullmatch(text) if says is _SAYS[-1] else says.search(text)
        what, word = found.groups() if found is not None else ("", "")
        what = (what or "").lower()
        if (
            found is not None
            and what not in _OF_OTHERS
            and (what in _OF_POINTS or word.lower() not in ANGLES)
        ):
            metres = metres_of(word, name)
            return None if metres is None else LengthUnit(metres, metres)
    return None


def metres_of(word: str, name: str) -> float | None:
    """Metres of a unit, None where it is not known.

    Raises
    ------
    ValueError
        It is an angle.
    """
    lowered = word.strip().lower()
    if lowered in ANGLES or lowered.startswith("degrees_"):
        raise fault(
            name, f"the unit of its x, y and z is {shorten(word)}", "give Cartesian coordinates in metres"
        )
    return known_metres(word)


def known_metres(word: str) -> float | None:
    """Metres of a unit of length, None where it is not known."""
    return _METRES.get(_BETWEEN.sub("", word.lower()))


def unit_given(x: Any, name: str) -> float | None:
    """Metres of the unit that an object says its values have; None where it says none that is known.

    Raises
    ------
    ValueError
        The unit is an angle.
    """
    for word in _words(x):
        metres = metres_of(word, name)
        if metres is not None:
            return metres
    return None


def one_unit(units: Iterable[float | None], name: str) -> float | None:
    """The unit of x, y and z from that of each.

    Raises
    ------
    ValueError
        They differ.
    """
    each = list(units)
    if len(set(each)) > 1:
        told = ", ".join("none" if metres is None else f"{metres:g} m" for metres in each)
        raise fault(name, f"the units of its x, y and z differ: {told}", "give all three in one unit")
    return each[0]


def as_commented(points: Array, comments: Iterable[str], name: str) -> Array:
    """Points (N, 3) in metres, by the first unit that the comments of their file name.

    Raises
    ------
    ValueError
        The unit is an angle.
    """
    lines = list(comments)
    for line in lines:
        scale = _SCALE.search(line)
        if scale is not None and _number(scale.group(1)) != 1.0:
            warnings.warn(
                f"{name}: its header says {shorten(scale.group(0).strip())}, which was not applied; if its coordinates "
                "are to be multiplied by that, do so and give the result",
                UserWarning,
                stacklevel=3,
            )
    unit = unit_in(lines, name) or LengthUnit()
    tell_stretch(points, unit, name)
    return in_metres(points, unit.across, name, up=unit.up)


def unit_in(comments: Iterable[str], name: str) -> LengthUnit | None:
    """The first unit that comments name, as `unit_said`."""
    return next((said for line in comments if (said := unit_said(line, name)) is not None), None)


def _of_system(text: str, name: str) -> LengthUnit | None:
    unit = unit_of_text(text)
    if unit.degrees:  # longitude and latitude, whatever the unit of heights is
        metres_of("degree", name)
    return None if unit.unknown else unit


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return 1.0


def _words(x: Any) -> Iterator[str]:
    for attribute in _ATTRIBUTES:
        yield from _word(getattr(x, attribute, None))
    for held in (x if isinstance(x, Mapping) else None, *(getattr(x, each, None) for each in _DICTIONARIES)):
        if isinstance(held, Mapping) or hasattr(held, "keys"):
            for key in _KEYS:
                yield from _word(_of(held, key))


def _of(held: Any, key: str) -> Any:
    # pyarrow's keys are bytes.
    return next((held[each] for each in (key, key.encode()) if each in list(held.keys())), None)


def _word(said: Any) -> Iterator[str]:
    # A column that is called so is no unit.
    if said is None or callable(said) or bool(getattr(said, "shape", ())) or isinstance(said, (int, float)):
        return
    yield said.decode("latin-1") if isinstance(said, bytes) else str(said)
