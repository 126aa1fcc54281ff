# SPDX-License-Identifier: MIT
"""The unit of x, y and z that the comments of a file name; what they say of it without being clear is told."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.coordinate_systems.length_unit import LengthUnit, in_metres, tell_stretch
from hybridreg.io.coordinate_systems.well_known_text import unit_of_text
from hybridreg.io.faults import shorten
from hybridreg.io.meaning.downward import tell_downward_comments
from hybridreg.io.meaning.scale_comments import tell_scale
from hybridreg.io.meaning.unit_words import ANGLES, CELLS, MULTIPLE, has_unit, metres_of, tell_cells

Array = NDArray[np.float64]

_WORD = r"(?:(?:u\.?s\.?|intl\.?|international)[ -]?(?:survey )?(?:ft|f[oe][oe]t)|[a-zµμ°]+)"
_END = r"(?=\s*(?:[,;:)\]]|\.(?:\s|$)|$))"  # so that `0.1 mm voxels` is no unit
_MANY = rf"(?:{MULTIPLE}{_WORD}{_END}|{_WORD}\b)"
_NUMBERS = (
    r"coordinates?|coords?|x[\s,/]*y[\s,/]*(?:and\s+|&\s*)?z|positions?|points?|vert(?:ex|ices)|values?|lengths?|"
    r"distances?"
)
_THINGS = (
    r"data|numbers?|axes|dimensions?|all|everything|clouds?|scans?|scanned|models?|export(?:ed)?|saved|stored|written|"
    r"measured|recorded|given|expressed"
)
_FLAGS = re.IGNORECASE
_SYSTEM = re.compile(r'UNIT\s*\[\s*"')  # of a coordinate reference system
# Each finds what has the unit, then the unit: `length unit: mm`, `unit: 0.1 mm`, `all values in mm`, `vertices (mm)`,
# `xyz [0.1 mm]`, `x y z mm`, `[mm]`.
_SAYS = (
    re.compile(rf"(?:([a-z]+)[ _-]+)?(?<![a-z])units?\b\W*(?:(?:is|are|in)\b\W*){{0,2}}({_WORD})", _FLAGS),
    re.compile(rf"()(?<![a-z_-])units?\b\s*(?:(?:[:=]|is|are|in|of)\s*){{1,3}}({MULTIPLE}{_WORD}){_END}", _FLAGS),
    re.compile(rf"\b({_NUMBERS}|{_THINGS})\b[\w ,]{{0,25}}?\bin ({_MANY})(?!\s*[:=]?\s*\d|-\w|\s+(?-i:[A-Z]))", _FLAGS),
    re.compile(rf"\b({_NUMBERS})\b\W*[:=(\[]\s*({_WORD})\W*", _FLAGS),
    re.compile(rf"\b(coordinates?|coords?|x\W*y\W*z|positions?|values?)\W*[(\[]\s*({MULTIPLE}{_WORD})\W*", _FLAGS),
    re.compile(rf"\b(x\W*y\W*z)\s+({_WORD})\W*", _FLAGS),
    re.compile(rf"()\W*[\[(]\s*({_WORD})\s*[\])]\s*", _FLAGS),
)  # fmt: skip
# Whole comments, or what ends them: `mm`, `in mm`, `Point cloud (mm)`. Here the word must be none of another meaning.
_BARE = (
    re.compile(rf"\W*(?:in )?({_WORD})\W*", _FLAGS),
    re.compile(rf".*\b(?:{_THINGS})\W*[(\[]\s*({_WORD})\W*", _FLAGS),
    re.compile(rf"\W*(?:all |the )?(?:data|numbers?|axes|dimensions?|all)\s*[:=]\s*({_WORD})\W*", _FLAGS),
)
_MEANS_MORE = (
    "in",
    "foot",
    "feet",
    "yard",
    "yards",
    "mil",
    "mils",
    "thou",
    "mi",
    "mile",
    "miles",
    "um",
    *ANGLES,
)
_PLACES = ("Ft", "Mi")  # as in Ft. Worth
# Before "unit": what has an angle, where that is x, y and z; what has a length that is not theirs.
_OF_POINTS = ("", "the", "all", "xyz", "coordinate", "coordinates", "position", "positions")
_OF_OTHERS = (
    "range", "time", "intensity", "wavelength", "pulse", "beam", "accuracy", "noise", "error", "resolution", "spacing",
    "step", "size", "diameter", "radius", "focal", "lens", "pixel", "voxel", "thickness", "depth", "width", "precision",
    "tolerance", "uncertainty", "std", "sigma", "rms", "rmse", "mae", "residual", "deviation", "baseline", "density",
    "scale", "sensor", "marker", "board", "camera", "laser", "target", "aperture", "gap", "threshold", "filter", "grid",
    "wave", "rain", "normal", "curvature", "distortion", "calibration", "calibrated",
)  # fmt: skip
_OTHER = re.compile(rf"(?<![a-z])(?:{'|'.join(_OF_OTHERS)})(?:s|es)?(?![a-z])", _FLAGS)
_CLAUSE = re.compile(r"[,;|]|\.\s")
# A unit that is mentioned; two letters in upper case are rather somebody's initials.
_PLAIN = r"[mcd]m|µm|μm|(?i:(?:milli|centi|deci|micro)met(?:re|er)s?)"
_AFTER = r"(?i:(?:(?<=in )|(?<=[\[(]))(?:inch(?:es)?|feet|(?-i:ft)|us[ -]ft|km|yd|yards?|mils?))"
_MENTIONS = re.compile(rf"(?<![\w./\\-])({_PLAIN}|{_AFTER})(?!\w|[./\\-]\w|\s*[:=]?\s*[-+]?\d|\s*[\^²³/])")
_CELLS = re.compile(
    rf"(?:^|[^a-z_ ]|\b(?:the|all|xyz|length|coordinates?)[ _-])\s*units?\s*(?:[:=]|is|are)\s*({'|'.join(CELLS)})\b",
    _FLAGS,
)
_LONGEST = 500  # characters of a comment that are looked at


def as_commented(points: Array, comments: Iterable[str], name: str, said: float | None = None) -> Array:
    """Points (N, 3) in metres, by the unit `said` elsewhere or by the first one that the comments of their file name.

    Raises
    ------
    ValueError
        The unit is an angle.
    """
    lines = [line if _SYSTEM.search(line) else line[:_LONGEST] for line in comments]
    tell_scale(lines, name)
    tell_downward_comments(lines, name)
    if said is not None:
        return in_metres(points, said, name)
    unit = unit_in(lines, name)
    if unit is None:
        tell_cells([found.group(1) for line in lines if (found := _CELLS.search(line))], name)
        _tell_mention(lines, name)
        return points
    tell_stretch(points, unit, name)
    return in_metres(points, unit.across, name, up=unit.up)


def unit_in(comments: Iterable[str], name: str) -> LengthUnit | None:
    """The first unit that comments name, as `unit_said`."""
    return next((said for line in comments if (said := unit_said(line, name)) is not None), None)


def unit_said(text: str, name: str) -> LengthUnit | None:
    """The unit that a comment such as `unit: mm` names for x, y and z; None where it names no known one.

    Raises
    ------
    ValueError
        The unit is an angle.
    """
    if _SYSTEM.search(text):
        return _of_system(text, name)
    for what, word in _said(text[:_LONGEST]) if has_unit(text[:_LONGEST]) else ():
        if what not in _OF_POINTS and word.lower() in ANGLES:
            continue
        metres = metres_of(word, name)
        if metres is not None:
            return LengthUnit(metres, metres)
    return None


def _said(text: str) -> Iterator[tuple[str, str]]:
    """What may have a unit, and the unit's words."""
    for k, says in enumerate(_SAYS):
        whole = k >= 3  # nothing may follow
        for found in says.finditer(text):
            what = re.sub(r"[\W_]+|\band\b", "", (found.group(1) or "").lower())
            if whole and (found.end() < len(text) or (says is _SAYS[-1] and found.start() > 0)):
                continue
            if k == 2 and found.group(2) in _PLACES:
                continue
            loose = k == 5 and found.group(2).lower() in _MEANS_MORE
            if (
                what not in _OF_OTHERS
                and not loose
                and (k < 2 or not _of_other(text, found.start(2), found.end()))
            ):
                yield what, found.group(2)
    for says in _BARE:
        bare = says.fullmatch(text)
        if (
            bare
            and bare.group(1).lower() not in _MEANS_MORE
            and not _of_other(text, bare.start(1), bare.end(1))
        ):
            yield "", bare.group(1)


def _of_other(text: str, start: int, end: int) -> bool:
    """Whether the length at `start:end` is that of a lens, a voxel, a noise: by the clause before it, a word behind."""
    before, behind = _CLAUSE.split(text[:start])[-1], text[end:].lstrip(" -)]:").split(" ", 1)[0]
    return bool(_OTHER.search(before) or _OTHER.match(behind))


def _tell_mention(lines: Iterable[str], name: str) -> None:
    for line in lines:
        found = _MENTIONS.search(line) if has_unit(line) else None
        if (
            found is None
            or re.search(r"\d\s*$", line[: found.start()])
            or _of_other(line, found.start(), found.end())
        ):
            continue
        warnings.warn(
            f"{name}: its header says {shorten(line.strip())}, and its x, y and z were read as metres; if they are in "
            f"{found.group(1)}, write so in a comment of its own, unit: {found.group(1)}",
            UserWarning,
            stacklevel=4,
        )
        return


def _of_system(text: str, name: str) -> LengthUnit | None:
    unit = unit_of_text(text)
    if unit.degrees:  # longitude and latitude, whatever the unit of heights is
        metres_of("degree", name)
    return None if unit.unknown else unit
