# SPDX-License-Identifier: MIT
"""Bounds on the fields of a stage, checked when it is created: an error is reported where the number was written."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any


def positive(stage: Any, *names: str) -> None:
    """Each named field must be None, a finite number above 0, or a list of such, which may not be empty.

    Raises
    ------
    ValueError
        Naming the field and its value.
    """
    for name in names:
        value = getattr(stage, name)
        items = _items(value)
        if value is not None and not (items and all(0.0 < item < math.inf for item in items)):
            raise ValueError(f"{name}={value} must be positive and finite")


def within(stage: Any, low: float, high: float, *names: str) -> None:
    """Each named field, or each item of one that is a list, must lie in `low` to `high`.

    Raises
    ------
    ValueError
        Naming the field and its value.
    """
    for name in names:
        value = getattr(stage, name)
        if not all(low <= item <= high for item in _items(value)):
            raise ValueError(f"{name}={value} must lie in {low:g} to {high:g}")


def at_least(stage: Any, low: int, *names: str) -> None:
    """Each named field must be `low` or more.

    Raises
    ------
    ValueError
        Naming the field and its value.
    """
    for name in names:
        value = getattr(stage, name)
        if not value >= low:
            raise ValueError(f"{name}={value} must be at least {low}")


def _items(value: Any) -> Sequence[Any]:
    return value if isinstance(value, (tuple, list)) else (value,)
