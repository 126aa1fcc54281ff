# SPDX-License-Identifier: MIT
"""Bounds on the fields of a stage, checked when it is created: an error is reported where the number was written."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from numbers import Real
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
        if value is not None and not (_items(value) and _all(value, lambda item: 0.0 < item < math.inf)):
            raise ValueError(f"{name}={_shown(value)} must be positive and finite")


def within(stage: Any, low: float, high: float, *names: str) -> None:
    """Each named field, or each item of one that is a list, must lie in `low` to `high`.

    Raises
    ------
    ValueError
        Naming the field and its value.
    """
    for name in names:
        value = getattr(stage, name)
        if not _all(value, lambda item: low <= item <= high):
            raise ValueError(f"{name}={_shown(value)} must lie in {low:g} to {high:g}")


def at_least(stage: Any, low: int, *names: str) -> None:
    """Each named field must be `low` or more.

    Raises
    ------
    ValueError
        Naming the field and its value.
    """
    for name in names:
        value = getattr(stage, name)
        if not _all(value, lambda item: item >= low):
            raise ValueError(f"{name}={_shown(value)} must be at least {low}")


def _all(value: Any, test: Callable[[Any], bool]) -> bool:
    # What is no number lies in no bounds; a configuration made in Python has not been checked for that.
    return all(isinstance(item, Real) and test(item) for item in _items(value))


def _shown(value: Any) -> Any:
    return repr(value) if isinstance(value, str) else value


def _items(value: Any) -> Sequence[Any]:
    return value if isinstance(value, (tuple, list)) else (value,)
