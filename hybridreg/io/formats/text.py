# SPDX-License-Identifier: MIT
"""Plain text clouds: one point a line, with any separator and any header lines."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.arrays import refuse_raw_las
from hybridreg.io.column_names import Axes
from hybridreg.io.faults import fault
from hybridreg.io.formats.text_first_row import axes_of_first_row, below_names
from hybridreg.io.formats.text_names import axes_in_comments, is_missing, is_number, names_in
from hybridreg.io.formats.text_rows import parse_rows, text_lines, without_counts
from hybridreg.io.meaning.beside_points import changes_points, with_what_is_beside
from hybridreg.io.meaning.first_column import check_first_column, looked_at, refuse_row_numbers
from hybridreg.io.meaning.homogeneous import refuse_homogeneous
from hybridreg.io.meaning.image_shapes import refuse_image
from hybridreg.io.meaning.spherical import tell_spherical
from hybridreg.io.meaning.unit_comments import as_commented
from hybridreg.io.signatures import looks_binary

_COMMENTS = ("#", "//", "%", ";")
_EXCEL = "sep="  # the row that tells Excel the separator
_FLAGS = {"true": "1", "false": "0", "yes": "1", "no": "0"}
_DECIMAL_COMMA = re.compile(r"[-+]?\d+(,\d+)?([eE][-+]?\d+)?")
_POSITION = Axes((0, 1, 2))


def parse_text(data: bytes, name: str) -> NDArray[np.float64]:
    """Read x, y and z of text rows separated by spaces, tabs, commas or semicolons; shape (N, 3), metres.

    Lines that begin with `#`, `//`, `%` or `;` are comments. A first row of names, or a comment of names before it,
    tells which columns are x, y and z, and perhaps their unit; otherwise the first three are. A first row of one whole
    number (PTS, XYZ) is the number of points and must be right; such a row with its points may follow again. A comma is
    a decimal point where something else separates the numbers.

    Raises
    ------
    ValueError
        No text, no rows, a row without numbers, a wrong count, or a first column of row numbers; or as
        `refuse_raw_las`.
    """
    if looks_binary(data):
        raise fault(name, "is not plain text: it holds zero bytes", "save it as UTF-8 text")
    lines = [line.strip(" ") for line in text_lines(data.removeprefix(b"\xef\xbb\xbf"))]
    first = next((index for index, line in enumerate(lines) if not line.startswith(_COMMENTS)), len(lines))
    rows = [line for line in lines[first:] if not line.startswith(_COMMENTS)]
    if rows and rows[0].lower().startswith(_EXCEL):
        rows = rows[1:]
    if not rows:
        raise fault(name, f"has {len(lines)} lines and none of numbers", "check that the export was complete")
    if rows[0].lower().startswith("ncols"):
        raise fault(
            name,
            "is a grid of heights (ESRI), not of points",
            "convert it: gdal_translate -of XYZ in.asc out.xyz",
        )
    delimiter, comma = _delimiter(_typical(rows))
    names = names_in(rows[0], delimiter)
    of_names = axes_of_first_row(rows, names, name) if names else None
    rows = rows[1:] if names else rows
    if of_names is not None:
        of_names, rows = below_names(of_names, names, rows, delimiter, name)
    rows = without_counts(rows, name)
    width = len(rows[0].split(delimiter)) if rows else 0
    named = of_names or axes_in_comments(lines[:first], delimiter, width, name)
    if named is None:
        refuse_image(len(rows), width, name)
    axes = named or _POSITION
    rows = [row.replace(",", ".") for row in rows] if comma else rows
    points = parse_rows(rows, axes.columns, name, delimiter)
    if names and np.array_equal(points, np.round(points)):
        refuse_raw_las(names, name)
    if named is None:
        _check_first(points, rows, delimiter, name)
    if names and any(map(changes_points, names)):
        points = with_what_is_beside(points, _beside(rows, names, delimiter), name)
    return as_commented(points, lines[:first], name, axes.metres)


def _beside(rows: list[str], names: list[str], delimiter: str | None) -> dict[str, list[float]]:
    """The columns of flags or numbers that may change the points."""
    cells = [row.split(delimiter) for row in rows]
    found = {}
    for k in (k for k, each in enumerate(names) if changes_points(each)):
        words = [row[k].strip(' "').lower() if k < len(row) else "" for row in cells]
        words = [_FLAGS.get(word, word) for word in words]
        if all(map(is_number, words)):
            found[names[k]] = [float(word) for word in words]
    return found


def _check_first(points: NDArray[np.float64], rows: list[str], delimiter: str | None, name: str) -> None:
    """Whether the first column of rows without names, which became x of `points` (N, 3), is one."""
    tell_spherical(points, name)
    words = rows[0].split(delimiter) if rows else []
    width = next((k for k, word in enumerate(words) if not (is_number(word) or is_missing(word))), len(words))
    if width <= 3:
        return
    cure = "name the columns in a first row, such as: id x y z"
    refuse_row_numbers(points[:, 0], name, cure)
    some = [rows[k].split(delimiter)[:width] for k in looked_at(len(rows))]
    whole = [row for row in some if len(row) == width and all(map(is_number, row))]
    table = np.array(whole, dtype=np.float64).reshape(-1, width)
    refuse_homogeneous(table, name, "x, y and z by w in each row")
    check_first_column(table, name, cure)


def _typical(rows: list[str]) -> str:
    # Not the first, which may be names, nor a cut-off last, nor a number of points.
    middle = len(rows) // 2
    return next((row for row in rows[middle:] if not row.isdecimal()), rows[middle])


def _delimiter(row: str) -> tuple[str | None, bool]:
    """What separates the numbers, None for spaces; and whether a comma is their decimal point."""
    if ";" in row:
        return ";", True
    words = row.split("\t" if "\t" in row else None)
    if "," in row and len(words) >= 3 and all(_DECIMAL_COMMA.fullmatch(word.strip()) for word in words[:3]):
        return ("\t" if "\t" in row else None), True
    return next((mark for mark in (",", "\t") if mark in row), None), False
