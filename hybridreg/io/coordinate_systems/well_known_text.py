# SPDX-License-Identifier: MIT
"""The unit that well-known text (WKT 1 and 2, and Esri's) gives a coordinate reference system."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from hybridreg.io.coordinate_systems.epsg_lengths import epsg_length
from hybridreg.io.coordinate_systems.length_unit import LengthUnit
from hybridreg.io.faults import shorten

_TOKEN = re.compile(r'"((?:[^"]|"")*)"|([\[(])|([\])])|([^\s"\[\](),]+)')
_FLAT = (
    "PROJCS",
    "PROJCRS",
    "PROJECTEDCRS",
    "DERIVEDPROJCRS",
    "LOCAL_CS",
    "ENGCRS",
    "ENGINEERINGCRS",
    "GEOCCS",
)
_GEODETIC = ("GEODCRS", "GEODETICCRS")  # in degrees, or geocentric in metres
_DEGREES = ("GEOGCS", "GEOGCRS", "GEOGRAPHICCRS")
_UPRIGHT = ("VERT_CS", "VERTCS", "VERTCRS", "VERTICALCRS")
_METHODS = ("PROJECTION", "METHOD")
_MERCATOR = re.compile(r"(popular visualisation pseudo )?mercator")
_UNITS = ("UNIT", "LENGTHUNIT")


@dataclass
class _Node:
    # `KEYWORD["word", 1, PART[...]]`
    keyword: str
    words: list[str] = field(default_factory=list)
    parts: list[_Node] = field(default_factory=list)

    def walk(self) -> Iterator[_Node]:
        """This node and all below it, in the order of the text."""
        waiting = [self]
        while waiting:
            node = waiting.pop()
            yield node
            waiting.extend(reversed(node.parts))

    def within(self, *keywords: str) -> list[_Node]:
        """Parts, not those of parts, that are called so."""
        return [part for part in self.parts if part.keyword in keywords]


def unit_of_text(text: str) -> LengthUnit:
    """What a system's well-known text says: of the first system across, and of the first that is upright.

    Source: OGC 12-063r5 (WKT 2), OGC 01-009 (WKT 1). A part's own unit counts, not those of the parts within it, such
    as the metres of its ellipsoid.
    """
    nodes = list(_parsed(text).walk())
    across = next((node for node in nodes if node.keyword in (*_FLAT, *_GEODETIC, *_DEGREES)), None)
    upright = next((node for node in nodes if node.keyword in _UPRIGHT), None)
    if across is not None and _in_degrees(across):
        return LengthUnit(up=next(iter(_lengths(upright) if upright else []), 1.0), degrees=True)
    lengths = _lengths(across) if across else []
    heights = _lengths(upright) if upright else lengths[2:]
    unknown = _told(across or upright, text) if not lengths or (upright and not heights) else ""
    metres = lengths[0] if lengths else 1.0
    up, stretched = heights[0] if heights else metres, across is not None and _is_mercator(across)
    return LengthUnit(metres, up, unknown=unknown, stretched=stretched)


def _parsed(text: str) -> _Node:
    top = _Node("")
    opened = [top]
    for quoted, opens, closes, word in _TOKEN.findall(text):
        if opens:
            node = _Node(opened[-1].words.pop().upper() if opened[-1].words else "")
            opened[-1].parts.append(node)
            opened.append(node)
        elif closes:
            opened = opened[:-1] if len(opened) > 1 else opened
        else:
            opened[-1].words.append(quoted or word)
    return top


def _is_mercator(node: _Node) -> bool:
    """Whether a system's projection is Mercator's with the scale of the equator, no transverse or oblique one."""
    nodes = list(node.walk())
    methods = [each.words[0].lower() for each in nodes if each.keyword in _METHODS and each.words]
    if not any(_MERCATOR.match(method) for method in methods):
        return False
    given = {
        re.sub(r"\W|_", "", each.words[0].lower()): value
        for each in nodes
        if each.keyword == "PARAMETER" and (value := _number(each)) is not None
    }
    parallels = [value for key, value in given.items() if "parallel" in key]
    scales = [value for key, value in given.items() if key.startswith("scalefactor")]
    return not any(parallels) and all(value == 1.0 for value in scales)


def _in_degrees(node: _Node) -> bool:
    systems = node.within("CS")
    ellipsoidal = bool(systems and systems[0].words and systems[0].words[0].lower() == "ellipsoidal")
    return node.keyword in _DEGREES or (node.keyword in _GEODETIC and ellipsoidal)


def _lengths(node: _Node) -> list[float]:
    """Metres of the unit of each axis, or of all in one; none where no unit is given."""
    own = [metres for part in node.within(*_UNITS) if (metres := _factor(part))]
    axes = [
        metres for axis in node.within("AXIS") for part in axis.within(*_UNITS) if (metres := _factor(part))
    ]
    if own or axes:
        return axes or own[-1:]
    codes = [
        part.words[1]
        for part in node.within("ID", "AUTHORITY")
        if part.words[:1] == ["EPSG"] and part.words[1:]
    ]
    known = [metres for code in codes if code.isdecimal() and (metres := epsg_length(int(code)))]
    return known[:1]


def _factor(node: _Node) -> float | None:
    metres = _number(node)
    return metres if metres is not None and math.isfinite(metres) and metres > 0.0 else None


def _number(node: _Node) -> float | None:
    try:
        return float(node.words[1])
    except (IndexError, ValueError):
        return None


def _told(node: _Node | None, text: str) -> str:
    return shorten(node.words[0] if node and node.words else text.strip("\0 "))
