# SPDX-License-Identifier: MIT
"""The unit of a file's points, as its coordinate reference system tells it."""

from __future__ import annotations

from typing import NamedTuple


class LengthUnit(NamedTuple):
    """Metres of one unit across (x, y) and up (z); whether x and y are degrees; and which system gives no unit that is
    known here, in words, "" where each does."""

    across: float = 1.0
    up: float = 1.0
    degrees: bool = False
    unknown: str = ""
