# SPDX-License-Identifier: MIT
"""Coordinates from rows of text, and which row is at fault where a value is not a number."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, shorten


def text_lines(data: bytes) -> list[str]:
    """The lines that are not empty; bytes that are not ASCII survive in comments and names as Latin-1."""
    lines = data.decode("latin-1").replace("\r", "\n").split("\n")
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


def parse_rows(
    lines: list[str], columns: tuple[int, int, int], name: str, delimiter: str | None = None
) -> NDArray[np.float64]:
    """The numbers in `columns` of each line, shape (N, 3)."""
    if not lines:
        return np.empty((0, 3))
    try:
        return np.loadtxt(lines, usecols=columns, delimiter=delimiter, comments=None, quotechar='"', ndmin=2)
    except ValueError as error:
        problem = _first_bad_row(lines, columns, delimiter) or shorten(error, 200)
        raise fault(name, problem, "remove or repair the row") from error


def _first_bad_row(lines: list[str], columns: tuple[int, int, int], delimiter: str | None) -> str:
    for number, line in enumerate(lines, start=1):
        values = line.split(delimiter)
        if len(values) <= max(columns):
            return f"row {number} has {len(values)} values, {max(columns) + 1} are needed: {shorten(line)}"
        for column in columns:
            try:
                float(values[column].strip(' "'))
            except ValueError:
                return f"row {number} has {shorten(values[column])} where a number is needed: {shorten(line)}"
    return ""
