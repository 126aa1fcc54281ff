# SPDX-License-Identifier: MIT
"""Cells of a CSV file that a spreadsheet shows and does not run."""

from __future__ import annotations

from typing import TypeVar

Value = TypeVar("Value")

# What a spreadsheet takes for the start of a formula, in ASCII and in the wide forms of the same signs.
_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")


def cell(value: Value) -> Value | str:
    """`value` as it may stand in a CSV file: a text that begins as a formula does, behind an apostrophe.

    Numbers, and texts that are numbers, stay what they are.
    """
    if not isinstance(value, str) or not value.lstrip(" ").startswith(_FORMULA):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value
