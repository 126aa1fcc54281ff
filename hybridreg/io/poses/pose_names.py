# SPDX-License-Identifier: MIT
"""A pose of one row whose columns a line before it names: which are its position and its quaternion."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from hybridreg.io.column_names import stem_and_unit
from hybridreg.io.coordinate_systems.length_unit import in_metres
from hybridreg.io.faults import fault, shorten
from hybridreg.io.formats.text_names import lists_in
from hybridreg.io.meaning.unit_words import known_metres

_AXES = "xyz"
_WIDEST = 100  # columns of a table that holds a pose
# What the parts of a quaternion are called, the scalar last: by the field, Hamilton, GTSAM and the like.
_PARTS = (
    ("x", "y", "z", "w"),
    *(("i", "j", "k", scalar) for scalar in ("w", "r", "real")),
    *(("x", "y", "z", scalar) for scalar in ("s", "r", "scalar")),
)
# Where no column is named, but the order is: `quaternion (w, x, y, z)`, `xyz wxyz`, `scalar first`.
_W_FIRST = re.compile(
    r"(?<![a-z])(?:q?w[\s,]*q?x[\s,]*q?y[\s,]*q?z|(?:w|scalar|real)(?:[ -]part)?[ -](?:is[ -])?first)(?![a-z])",
    re.IGNORECASE,
)
_POSE = 7  # numbers of a position and a quaternion
_COUNTED = re.compile(r"(.*?)[_.\[(]?(\d)[\])]?")
_INNER = re.compile(r"[\[(]([^\[\]()]+)[\])]\W*$")


class Named(NamedTuple):
    """x y z qx qy qz qw, and whether a unit stood beside the names of x, y and z, so that they are metres."""

    numbers: list[float]
    has_unit: bool = False


def in_order(row: Sequence[float], before: Sequence[str], name: str) -> Named | None:
    """x y z qx qy qz qw of a row of numbers, by the last of the lines before it that names every column.

    Many tools write w before x, y and z, and say so only there, as EuRoC's files do. None where no line names a
    position and a quaternion, or where it is not clear which columns they are.

    Raises
    ------
    ValueError
        The parts of the quaternion are counted: of `q0 q1 q2 q3` and `q1 q2 q3 q4` some have w first, some last.
    """
    lines = list(reversed(before)) if len(row) <= _WIDEST else []
    for line in lines:
        for names in _lists(line, len(row)):
            found = _columns([stem_and_unit(each) for each in names])
            if found is not None:
                position, metres, quaternion = found
                place = in_metres(np.array([[row[k] for k in position]]), metres, name)
                return Named([*place[0].tolist(), *(row[k] for k in quaternion)], metres is not None)
            _refuse_counted(names, name)
        if len(row) in (_POSE, _POSE + 1) and _W_FIRST.search(line):
            return Named([*row[-7:-4], *row[-3:], row[-4]])
    return None


def _refuse_counted(names: Sequence[str], name: str) -> None:
    counted: dict[str, list[int]] = {}
    for each in names:
        if found := _COUNTED.fullmatch(each.strip().lower()):
            counted.setdefault(found.group(1), []).append(int(found.group(2)))
    fours = [numbers for numbers in counted.values() if numbers in ([0, 1, 2, 3], [1, 2, 3, 4])]
    if len(fours) == 1:  # several are the rows of a matrix, such as `T00 T01 T02 T03 T10` and so on
        problem = f"its columns {shorten(' '.join(names))} do not say which part of the quaternion is w"
        raise fault(name, problem, "call them x y z qx qy qz qw, or x y z qw qx qy qz, in their order")


def _lists(line: str, width: int) -> Iterator[list[str]]:
    """The last `width` names of a line, of what stands in brackets at its end, or of what stands before these; without
    words before the first."""
    inner = _INNER.search(line)
    for text in (line, *((inner.group(1), line[: inner.start()]) if inner else ())):
        for names in lists_in(text, None):
            last = names[-width:]
            if len(last) == width and last[0]:
                yield [last[0].split()[-1] if "[" not in last[0] else last[0], *last[1:]]


def _columns(names: Sequence[tuple[str, str]]) -> tuple[list[int], float | None, list[int]] | None:
    stems = [stem for stem, _ in names]
    turns = {
        tuple(columns)
        for parts in _PARTS
        for stem in stems
        if stem.endswith(parts[-1]) and (columns := _together(stems, stem.removesuffix(parts[-1]), parts))
    }
    if len(turns) != 1:
        return None
    quaternion = list(turns.pop())
    places = [
        columns
        for stem in stems
        if stem.endswith("x")
        and (columns := _together(stems, stem[:-1], _AXES))
        and not {*columns} & {*quaternion}
    ]
    if not places:
        return None
    # Where velocities and the like stand there too, x, y and z alone are the position, or else what comes first.
    position = next((each for each in places if stems[each[0]] == "x"), places[0])
    units = {names[k][1] for k in position}
    return position, known_metres(units.pop()) if len(units) == 1 else None, quaternion


def _together(stems: Sequence[str], prefix: str, axes: Sequence[str]) -> list[int]:
    wanted = [prefix + axis for axis in axes]
    return [stems.index(each) for each in wanted] if all(stems.count(each) == 1 for each in wanted) else []
