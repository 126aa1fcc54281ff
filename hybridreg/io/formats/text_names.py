# SPDX-License-Identifier: MIT
"""The names of columns in the first row of a text file, or in one of the comments before it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from hybridreg.io.column_names import Axes, find_axes

# What stands before the names in a comment.
_TITLE = re.compile(r"\w+\s*[:=]\s+|(columns|fields|format|header|names)\W+", re.IGNORECASE)
# Of pandas, R, MySQL, Excel, and of C's library on Windows.
_MISSING = re.compile(
    r"|null|none|nil|n/?a|<na>|-{1,2}|\?|\\n|missing|#(?:n/a|num!|value!|div/0!)|[-+]?nan\(\w*\)|[-+]?1\.#\w+",
    re.IGNORECASE,
)
_MARKS = "#/%; \t"


def names_in(row: str, delimiter: str | None) -> list[str]:
    """The names in a row of names, with their units and without quotes; none if it is a row of numbers."""
    if delimiter is None:  # a unit belongs to the name before it
        row = re.sub(r"\s+(?=[\[(])", "", row)
        row = re.sub(r"[\[(][^\[(\])]{0,40}[\])]", lambda unit: re.sub(r"\s+", "", unit.group()), row)
    words = [word.strip().strip("\"'").strip() for word in row.split(delimiter)]
    if any(is_number(word.replace(",", ".")) for word in words) or all(map(is_missing, words)):
        return []
    return _of_all(words) if delimiter is None else words


def axes_in_comments(comments: Sequence[str], delimiter: str | None, width: int, name: str) -> Axes | None:
    """x, y and z by the last comment that names them, of rows of `width` values; None where none does.

    Most comments are prose: one that names each column comes first, then one that names x, y and z among fewer.

    Raises
    ------
    ValueError
        As `find_axes`, of a comment that names each column.
    """
    lists = [names for line in reversed(comments) for names in lists_in(line, delimiter)]
    for names in lists:
        for ending in (names, names[-width:]):
            if len(ending) == width and (found := find_axes(ending, name)) is not None:
                return found
    for names in lists:
        found = _axes_or_prose(names, name)
        if found is not None and max(found.columns) < width:
            return found
    return None


def is_number(word: str) -> bool:
    """Whether a word is a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def is_missing(word: str) -> bool:
    """Whether a cell is what tools write for a number that is missing or not finite; `nan` is a number."""
    return _MISSING.fullmatch(word.strip(' "\t')) is not None


def lists_in(comment: str, delimiter: str | None) -> Iterator[list[str]]:
    """The lists of names that a comment, or a line of words, may be read as."""
    text = comment.strip(_MARKS)
    for row in dict.fromkeys((_TITLE.sub("", text, count=1) if _TITLE.match(text) else text, text)):
        for mark in dict.fromkeys((delimiter, *(each for each in (",", ";", "\t") if each in row), None)):
            yield _of_all(names_in(row, mark))


def _axes_or_prose(names: list[str], name: str) -> Axes | None:
    try:
        return find_axes(names, name)
    except ValueError:
        return None


def _of_all(names: list[str]) -> list[str]:
    """`x y z (mm)` as `x (mm) y (mm) z (mm)`."""
    units = [unit.group() if (unit := re.search(r"[\[(].*", each)) else "" for each in names]
    last = next((k for k, unit in enumerate(units) if unit), 0)
    before = slice(max(0, last - 2), last)
    if any(units[last + 1 :]) or [each.lower() for each in names[before]] != ["x", "y"]:
        return names
    return [*names[: last - 2], *(f"{each} {units[last]}" for each in names[before]), *names[last:]]
