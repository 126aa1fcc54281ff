# SPDX-License-Identifier: MIT
"""Which of several columns are x, y and z by their names, and in what unit."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from hybridreg.io.faults import fault, shorten
from hybridreg.io.meaning.downward import refuse_downward, tell_downward
from hybridreg.io.meaning.spherical import refuse_spherical
from hybridreg.io.meaning.unit_words import ANGLES, known_metres, tell_cells

_AXES = ("x", "y", "z")
# What tools put before or behind an axis: ROS, E57, ParaView, spreadsheets. Not `n` or `v`: normals and velocities.
_AFFIXES = (
    "point", "points", "pos", "position", "coord", "coords", "coordinate", "cartesian", "p", "xyz", "lidar", "velo",
    "sensor", "loc", "location", "geometry", "geom", "points_m_xyz", "first", "1",
)  # fmt: skip
# What surveyors call x, y and z. Not `east` and `north`, which the prose of comments holds too.
_SURVEY = (
    ("easting", "eastings", "e", "utm_easting", "utm_e", "utm_x", "x_utm"),
    ("northing", "northings", "n", "utm_northing", "utm_n", "utm_y", "y_utm"),
    ("height", "elevation", "elev", "altitude", "h", "u", "z", "utm_z", "z_utm"),
)
# Not `in`, which is the counterpart of `out` too.
_ENDS = r"[mcdkuµ]?m|ft|us[_-]?ft|ftus|feet|inch|inches|yd|(?:milli|centi|deci|kilo)?met(?:er|re)s?"
_NAME = re.compile(rf"(.*?)\s*(?:[\[(]([^\])]*)[\])]?|[/|]\s*([^/|]+)|[_ ]({_ENDS}))?")


class Axes(NamedTuple):
    """Columns of x, y and z, and their unit in metres; None where the names do not give one."""

    columns: tuple[int, int, int]
    metres: float | None = None


def find_axes(names: Sequence[str], name: str) -> Axes | None:
    """x, y and z among the columns of the cloud called `name`, upper or lower case; None where nothing names them.

    A single column of each, or, if there is none, a single group that has x, y and z after (before) one common word,
    such as `cartesianX`, `Points:0`, `x_coord`, or a single easting, northing and height. A unit may follow: `X (mm)`,
    `x[cm]`, `y / ft`, `z_m`.

    Raises
    ------
    ValueError
        Several columns fit; one axis is in another unit than the others; an axis is an angle.
    """
    parsed = [stem_and_unit(each) for each in names]
    stems = [stem for stem, _ in parsed]
    if all(stems.count(axis) == 1 for axis in _AXES):
        return _with_unit((stems.index("x"), stems.index("y"), stems.index("z")), parsed, name)
    survey = _survey(stems)
    if "x" in stems or "y" in stems or ("z" in stems and survey is None):
        return None
    groups = list(dict.fromkeys((*_groups(stems), *([survey] if survey else []))))
    if len(groups) > 1:
        told = " and ".join(", ".join(str(names[column]) for column in group) for group in groups[:3])
        raise fault(
            name, f"has several columns that could be x, y and z: {told}", "call one group x, y and z"
        )
    return _with_unit(groups[0], parsed, name) if groups else None


def axes_in(names: Sequence[str], name: str) -> Axes:
    """As `find_axes`, but x, y and z must be found.

    Raises
    ------
    ValueError
        As `find_axes`; no columns, or several of one name, are x, y and z.
    """
    found = find_axes(names, name)
    if found is not None:
        return found
    stems = [stem_and_unit(each)[0] for each in names]
    held = shorten(", ".join(map(str, names)), 200)
    if {"lon", "lat"} & {stem[:3] for stem in stems} and "x" not in stems:
        problem = f"its columns {held} are longitudes and latitudes"
        raise fault(name, problem, "project them to metres first, for example with pyproj to UTM")
    if "x" not in stems:
        refuse_spherical(names, name)
    if "z" not in stems:
        refuse_downward(names, name)
    axis = next(axis for axis in _AXES if stems.count(axis) != 1)
    problem = f"has {stems.count(axis)} fields called {axis!r} among {held}"
    raise fault(name, problem, "name the coordinates x, y and z, each once")


def stem_and_unit(label: str) -> tuple[str, str]:
    """A column's lower-case name without quotes, and its unit."""
    match = _NAME.fullmatch(str(label).strip().strip("\"'").strip().lower())
    if match is None:
        return str(label).lower(), ""
    stem, *units = match.groups()
    return stem.strip(), next((unit.strip() for unit in units if unit), "")


def _groups(stems: Sequence[str]) -> Iterator[tuple[int, int, int]]:
    for stem in stems:
        for end in ("x", "0"):
            axes = _AXES if end == "x" else ("0", "1", "2")
            for found in (
                re.fullmatch(rf"(.+?)([_.: -]?){end}(1?)", stem),
                re.fullmatch(r"(x)([_.: -]?)(.+)", stem),
            ):
                if found is None or (found.group(1) == "x" and end == "0"):
                    continue
                first, mark, last = found.groups()
                word = last if first == "x" else first
                if word not in _AFFIXES:
                    continue
                wanted = [
                    f"{axis}{mark}{last}" if first == "x" else f"{first}{mark}{axis}{last}" for axis in axes
                ]
                if all(stems.count(each) == 1 for each in wanted):
                    a, b, c = (stems.index(each) for each in wanted)
                    yield a, b, c


def _survey(stems: Sequence[str]) -> tuple[int, int, int] | None:
    """Easting, northing and height, where only one column can be each: two heights have two meanings."""
    fitting = [[k for k, stem in enumerate(stems) if stem in words] for words in _SURVEY]
    if any(len(columns) != 1 for columns in fitting):
        return None
    (x,), (y,), (z,) = fitting
    return x, y, z


def _with_unit(columns: tuple[int, int, int], parsed: Sequence[tuple[str, str]], name: str) -> Axes:
    units = [parsed[column][1] for column in columns]
    angle = next((unit for unit in units if unit in ANGLES), None)
    if angle is not None:
        raise fault(name, f"its x, y or z is in {angle!r}", "give Cartesian coordinates in metres")
    tell_cells(units, name)
    tell_downward(units[2], name)
    known = [known_metres(unit) for unit in units]
    metres = [1.0 if each is None else each for each in known]
    if len(set(metres)) > 1:
        told = ", ".join(unit or "none" for unit in units)
        raise fault(name, f"the units of its x, y and z differ: {told}", "give all three in one unit")
    return Axes(columns, metres[0] if any(each is not None for each in known) else None)
