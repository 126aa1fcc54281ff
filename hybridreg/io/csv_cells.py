# SPDX-License-Identifier: MIT
"""Cells of a CSV file that a spreadsheet displays instead of evaluating as formulas."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable
from typing import Any, TypeVar

Value = TypeVar("Value")

# What a spreadsheet takes for the start of a formula, in ASCII and in the full-width forms of these characters.
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")


def cell(value: Value) -> Value | str:
    """`value` as it is safe in a CSV file: text that begins like a formula gets an apostrophe in front.

    Numbers, and texts that are numbers, stay as they are.
    """
    if not isinstance(value, str) or not value.lstrip(" ").startswith(_FORMULA):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """A CSV file of these rows, each value as `cell` makes it."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([cell(value) for value in row] for row in rows)
    return text.getvalue()
