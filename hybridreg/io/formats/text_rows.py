# SPDX-License-Identifier: MIT
"""Coordinates from rows of text, and which row is at fault where a value is not a number."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, shorten
from hybridreg.io.formats.text_names import is_missing, is_number

# Values in the rows behind a PTX scan's two counts: the scanner's place and axes, and a matrix.
_PTX = [3, 3, 3, 3, 4, 4, 4, 4]
# Digits in threes, with what spreadsheets and surveyors put between them: `450'002.74`, `5.399.995,40`.
_IN_THREES = re.compile(r"[-+]?\d{1,3}(?:[.,'’\u00a0\u202f]\d{3})+(?:[.,]\d*)?")


def text_lines(data: bytes) -> list[str]:
    """The lines that are not empty, in UTF-8 where they are so, and in Latin-1, which reads any bytes, otherwise."""
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    lines = text.replace("\r", "\n").split("\n")
    return [line for line in lines if line and not line.isspace()]


def promised_lines(lines: list[str], start: int, count: int, width: int, name: str) -> list[str]:
    """`count` rows from `start` on; too few, or a last row cut short, is a `ValueError`."""
    rows = lines[start : start + count]
    if len(rows) < count:
        raise fault(name, f"its header promises {count} points, it holds {len(rows)} lines of them")
    if rows and len(rows[-1].split()) < width:
        held = len(rows[-1].split())
        raise fault(name, f"its last point has {held} of {width} values: {shorten(rows[-1])}")
    return rows


def without_counts(rows: list[str], name: str) -> list[str]:
    """The rows of points of one or several blocks (PTS), each behind a row with the number of its points."""
    if len(rows) < 2 or not rows[0].isdecimal():
        return rows
    if rows[1].isdecimal() and [len(row.split()) for row in rows[2:10]] == _PTX:
        cure = "export it as .ply or .pts, for example with CloudCompare"
        raise fault(name, "is a PTX scan: the scanner's pose stands before its points", cure)
    kept: list[str] = []
    begin = start = 0
    while start < len(rows) and rows[start].isdecimal():
        begin, start = start, start + 1 + int(rows[start][:18])
        kept.extend(rows[begin + 1 : start])
    if start == len(rows):
        return kept
    which = f"row {begin + 1}" if begin else "first row"
    held = f"{len(rows) - begin - 1} rows follow"
    raise fault(name, f"its {which} promises {shorten(rows[begin])} points, {held}")


def parse_rows(
    lines: list[str], columns: tuple[int, int, int], name: str, delimiter: str | None = None
) -> NDArray[np.float64]:
    """The numbers in `columns` of each line, shape (N, 3); NaN for a cell that is empty or says that it has none."""
    if not lines:
        return np.empty((0, 3))
    try:
        return np.loadtxt(lines, usecols=columns, delimiter=delimiter, comments=None, quotechar='"', ndmin=2)
    except ValueError as error:
        cells = [cell.strip(' "') for cell in [*lines[0].split(delimiter), *lines[0].split('"')]]
        apart = next((cell for cell in cells if _IN_THREES.fullmatch(cell) and not is_number(cell)), None)
        if apart is not None:
            problem = f"its numbers have separators of thousands: {shorten(lines[0])}"
            raise fault(name, problem, "export them without") from error
        filled = [_with_nans(line, columns, delimiter) for line in lines]
        if filled != lines:
            return parse_rows(filled, columns, name, delimiter)
        problem = _first_bad_row(lines, columns, delimiter) or shorten(error, 200)
        raise fault(name, problem, "remove or repair the row") from error


def _with_nans(line: str, columns: tuple[int, int, int], delimiter: str | None) -> str:
    values = line.split(delimiter)
    missing = [column for column in columns if column < len(values) and is_missing(values[column])]
    if not missing:
        return line
    for column in missing:
        values[column] = "nan"
    return (delimiter or " ").join(values)


def _first_bad_row(lines: list[str], columns: tuple[int, int, int], delimiter: str | None) -> str:
    for number, line in enumerate(lines, start=1):
        values = line.split(delimiter)
        if len(values) <= max(columns):
            return f"row {number} has {len(values)} values, {max(columns) + 1} are needed: {shorten(line)}"
        for column in columns:
            if not is_number(values[column].strip(' "')):
                return f"row {number} has {shorten(values[column])} where a number is needed: {shorten(line)}"
    return ""
