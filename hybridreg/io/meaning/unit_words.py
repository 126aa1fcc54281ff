# SPDX-License-Identifier: MIT
"""Units of length by their words: `mm`, `US survey feet`, `0.1 mm`, `1/10 mm`, `1e-3 m`."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Sequence

from hybridreg.io.faults import fault, shorten

# Without spaces, full stops and hyphens, which are put between the letters in every way.
_METRES = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 1e-3),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters"), 1e-2),
    **dict.fromkeys(("dm", "decimetre", "decimetres", "decimeter", "decimeters"), 1e-1),
    **dict.fromkeys(("km", "kilometre", "kilometres", "kilometer", "kilometers"), 1e3),
    **dict.fromkeys(("um", "µm", "μm", "micrometre", "micrometres", "micrometer", "micrometers"), 1e-6),
    **dict.fromkeys(("micron", "microns"), 1e-6),
    **dict.fromkeys(("nm", "nanometre", "nanometres", "nanometer", "nanometers"), 1e-9),
    **dict.fromkeys(("ft", "foot", "feet", "intlft", "internationalfoot", "internationalfeet"), 0.3048),
    **dict.fromkeys(("ftus", "usft", "usfoot", "usfeet", "sft", "surveyfoot", "surveyfeet"), 1200 / 3937),
    **dict.fromkeys(("ussurveyft", "ussurveyfoot", "ussurveyfeet"), 1200 / 3937),
    **dict.fromkeys(("in", "inch", "inches"), 0.0254),
    **dict.fromkeys(("mil", "mils", "thou"), 0.0254e-3),
    **dict.fromkeys(("yd", "yds", "yard", "yards"), 0.9144),
    **dict.fromkeys(("mi", "mile", "miles"), 1609.344),
    # Of soundings and charts.
    **dict.fromkeys(("fathom", "fathoms", "ftm"), 1.8288),
    **dict.fromkeys(("nauticalmile", "nauticalmiles", "nmi"), 1852.0),
}
_LETTERS = re.compile(r"[a-zµμ°]+")
ANGLES = ("deg", "degree", "degrees", "°", "rad", "radian", "radians")
# As NetCDF's conventions (CF 1.11, 4.1) let a longitude's and a latitude's be written.
_ON_EARTH = re.compile(r"degrees?_?(?:north|east|n|e|true)")
# What counts, and has no length of its own.
CELLS = (
    "px",
    "pixel",
    "pixels",
    "voxel",
    "voxels",
    "cell",
    "cells",
    "count",
    "counts",
    "lsb",
    "tick",
    "ticks",
)

_BETWEEN = re.compile(r"[\s._-]+")
_NUMBER = r"(?:10\s*\^\s*-?\d+|(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)"
_PARTS = {"tenth": 0.1, "hundredth": 0.01, "thousandth": 0.001}
MULTIPLE = rf"(?:{_NUMBER}(?:\s*/\s*\d+)?\s*[*x]?\s*|(?:{'|'.join(_PARTS)})s?\s*of\s*(?:an?\s+)?)"
"""What may stand before a unit, as a regular expression without groups, of lower-case text."""
_TIMES = re.compile(rf"({MULTIPLE})([^\d\W].*)")
_PER = re.compile(rf"([^\d\W][^*/]*?)\s*([*/])\s*({_NUMBER})")


def has_unit(text: str) -> bool:
    """Whether a text holds a word that may be a unit: a quick look at what is mostly prose."""
    return any(word in _METRES or word in ANGLES for word in _LETTERS.findall(text.lower()))


def known_metres(word: str) -> float | None:
    """Metres of a unit of length or of a multiple of it, None where it is not known."""
    lowered = word.strip().lower()
    metres = _METRES.get(_BETWEEN.sub("", lowered))
    if metres is not None:
        return metres
    if found := _TIMES.fullmatch(lowered):
        factor, unit = _factor(found.group(1)), found.group(2)
    elif found := _PER.fullmatch(lowered):
        factor, unit = _value(found.group(3)), found.group(1)
        factor = factor if found.group(2) == "*" else 1.0 / factor if factor else 0.0
    else:
        return None
    metres = _METRES.get(_BETWEEN.sub("", unit))
    return metres * factor if metres is not None and 0.0 < factor < float("inf") else None


def column_of_units(names: Sequence[str]) -> int | None:
    """Which of some columns says the unit of each row, if any."""
    return next((k for k, each in enumerate(names) if each.lower() in ("unit", "units")), None)


def metres_of(word: str, name: str) -> float | None:
    """Metres of a unit, None where it is not known.

    Raises
    ------
    ValueError
        It is an angle.
    """
    lowered = word.strip().lower()
    if lowered in ANGLES or lowered.startswith("degrees_") or _ON_EARTH.fullmatch(lowered):
        raise fault(
            name, f"the unit of its x, y and z is {shorten(word)}", "give Cartesian coordinates in metres"
        )
    return known_metres(word)


def tell_cells(words: Iterable[str], name: str) -> None:
    """Warn where one of the words for the unit of x, y and z is what has no length of its own, such as voxels."""
    cells = next((word for word in words if word.strip().lower() in CELLS), None)
    if cells is None:
        return
    warnings.warn(
        f"{name}: its x, y and z are in {cells!r}, which is no length, and were read as metres; if one of them has "
        "another length, multiply by it and give the result",
        UserWarning,
        stacklevel=4,
    )


def _factor(text: str) -> float:
    part = next((value for start, value in _PARTS.items() if text.startswith(start)), None)
    if part is not None:
        return part
    above, *below = text.strip(" *x").split("/")
    under = _value(below[0]) if below else 1.0
    return _value(above) / under if under else 0.0


def _value(text: str) -> float:
    base, power, exponent = text.partition("^")
    try:
        return float(base) ** float(exponent) if power else float(text)
    except (OverflowError, ValueError):
        return 0.0
