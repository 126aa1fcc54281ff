# SPDX-License-Identifier: MIT
"""The first row of a text file that holds no numbers: the names of its columns, or what else, in words."""

from __future__ import annotations

import re
from collections.abc import Sequence

from hybridreg.io.column_names import Axes, axes_in
from hybridreg.io.faults import fault, shorten
from hybridreg.io.meaning.length_units import one_unit
from hybridreg.io.meaning.unit_words import ANGLES, column_of_units, known_metres

_AROUND = " \t\"'()[]"
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_THREE = re.compile(rf"{_NUMBER}(?:[\s,;]+{_NUMBER}){{2}}")
# Three numbers with another separator, or with Fortran's exponents of double precision.
_OTHER_MARK = re.compile(rf"{_NUMBER}\s*([|:/_&])\s*{_NUMBER}\s*\1\s*{_NUMBER}")
_FORTRAN = re.compile(rf"{_NUMBER}[dD][-+]?\d+[\s,;]")


def axes_of_first_row(rows: Sequence[str], names: Sequence[str], name: str) -> Axes:
    """x, y and z among the `names` that the first of the `rows` holds.

    Raises
    ------
    ValueError
        The row names no such columns; the message says what it is instead, and what to do.
    """
    try:
        return axes_in(names, name)
    except ValueError as error:
        problem, cure = _instead(rows)
        if problem:
            raise fault(name, problem, cure) from error
        told = str(error).removeprefix(f"{name}: ")
        row = "its first row holds no numbers, so that it was read as the names of the columns: it"
        raise (ValueError(f"{name}: {row} {told}") if "fields called" in told else error) from None


def below_names(
    axes: Axes, names: Sequence[str], rows: list[str], delimiter: str | None, name: str
) -> tuple[Axes, list[str]]:
    """x, y and z with the unit that a row below their names or a column `unit` gives, and the rows without such a row.

    Raises
    ------
    ValueError
        The units are angles, or differ.
    """
    cells = _cells(rows[0], delimiter) if rows else []
    if len(cells) > max(axes.columns) and all(_is_unit(cells[k]) for k in axes.columns):
        told = [f"{axis} ({cells[k]})" for axis, k in zip("xyz", axes.columns, strict=True)]
        return Axes(axes.columns, axes_in(told, name).metres), rows[1:]
    column = column_of_units(names)
    if column is None or axes.metres is not None:
        return axes, rows
    said = {cells[column] for row in rows if len(cells := _cells(row, delimiter)) > column}
    return Axes(axes.columns, one_unit(map(known_metres, said), name)), rows


def _cells(row: str, delimiter: str | None) -> list[str]:
    return [cell.strip(_AROUND) for cell in row.split(delimiter)]


def _is_unit(cell: str) -> bool:
    return known_metres(cell) is not None or cell.lower() in ANGLES


def _instead(rows: Sequence[str]) -> tuple[str, str]:
    """What the first row is and what to do about it; "" where it may be names."""
    row = rows[0]
    mark = next(
        filter(None, map(_OTHER_MARK.match, rows[:2])), None
    )  # in the second where the first has names
    if mark:
        return (
            f"its numbers are separated by {mark.group(1)!r}: {shorten(mark.string)}",
            "separate them by spaces or commas",
        )
    if _FORTRAN.match(row):
        return f"its numbers have a D before their exponents: {shorten(row)}", "write an E for it"
    without = next((k for k, each in enumerate(rows) if _THREE.match(each)), len(rows))
    if 1 < without < len(rows):
        problem = f"its first {without} rows hold no points, from {shorten(row)} on"
        return (
            problem,
            "begin those that are comments with #; one row may name the columns x, y and z",
        )
    if (not row[:1].isalnum() and row[:1] not in "\"'<([{_,") or row[:2] == "' ":
        return f"its first row, {shorten(row)}, is no comment", "begin comments with #"
    return "", ""
