# SPDX-License-Identifier: MIT
"""What differs between two configurations, in words."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any


def differences(old: Any, new: Any, name: str = "") -> Iterator[str]:
    """What changed between two configurations, one phrase a leaf."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in sorted({*old, *new}):
            yield from differences(old.get(key), new.get(key), f"{name}.{key}" if name else key)
    elif old != new:
        yield f"{name}: {_short(old)} before, {_short(new)} now"


def _short(value: Any) -> str:
    return "unset" if value is None else json.dumps(value)
