# SPDX-License-Identifier: MIT
"""Plain text clouds: one point a line, whatever separates its numbers and whatever stands above them."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, shorten
from hybridreg.io.records import axis_columns
from hybridreg.io.signatures import looks_binary
from hybridreg.io.text_rows import parse_rows, text_lines

_COMMENTS = ("#", "//", "%", ";")
_DELIMITERS = (";", ",", "\t")


def parse_text(data: bytes, name: str) -> NDArray[np.float64]:
    """Read x, y and z of text rows separated by spaces, tabs, commas or semicolons; shape (N, 3).

    Lines that begin with `#`, `//`, `%` or `;` are comments. A first row of names (CloudCompare puts it
    behind a comment mark) tells which columns are x, y and z, otherwise the first three are. A first row of
    one whole number (PTS, XYZ) is the count of the points and must agree. With semicolons, a comma is a
    decimal point.
    """
    if looks_binary(data):
        raise fault(name, "is not plain text: it holds zero bytes", "save it as UTF-8 text")
    lines = [line.strip(" ") for line in text_lines(data.removeprefix(b"\xef\xbb\xbf"))]
    first = next((index for index, line in enumerate(lines) if not line.startswith(_COMMENTS)), len(lines))
    rows = [line for line in lines[first:] if not line.startswith(_COMMENTS)]
    if not rows:
        raise fault(name, f"has {len(lines)} lines and none of numbers", "check that the export was complete")
    delimiter = _delimiter(rows[len(rows) // 2])  # not the first, which may be names, nor a cut-off last
    columns = (0, 1, 2)
    named = _names(rows[0], delimiter)
    if named:
        columns = axis_columns(named, name)
        rows = rows[1:]
    elif first and (named := _commented_names(lines[first - 1], delimiter)):
        columns = axis_columns(named, name)
    return parse_rows(_plain(_counted(rows, name), delimiter), columns, name, delimiter)


def _delimiter(row: str) -> str | None:
    return next((mark for mark in _DELIMITERS if mark in row), None)


def _plain(rows: list[str], delimiter: str | None) -> list[str]:
    return [row.replace(",", ".") for row in rows] if delimiter == ";" else rows


def _names(row: str, delimiter: str | None) -> list[str]:
    """The names in a row of names: lower case, without quotes and units; none if it is a row of numbers."""
    words = [re.sub(r"[\[(].*|[\"']", "", word).strip() for word in row.split(delimiter)]
    words = words if delimiter else [word for word in words if word]
    return [] if any(_is_number(word.replace(",", ".")) for word in words) else words


def _commented_names(line: str, delimiter: str | None) -> list[str]:
    # Most comments are prose: only one that has an x, a y and a z is taken for the names of the columns.
    words = line.lstrip("#/%; ")
    for mark in (delimiter, None):
        names = _names(words, mark)
        if {"x", "y", "z"} <= {label.lower() for label in names}:
            return names
    return []


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _counted(rows: list[str], name: str) -> list[str]:
    if len(rows) < 2 or not rows[0].isdecimal():
        return rows
    if int(rows[0][:18]) != len(rows) - 1:
        problem = f"its first row promises {shorten(rows[0])} points, {len(rows) - 1} rows follow"
        raise fault(name, problem)
    return rows[1:]
