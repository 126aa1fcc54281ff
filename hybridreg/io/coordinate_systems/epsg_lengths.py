# SPDX-License-Identifier: MIT
"""The unit of length of EPSG's coordinate systems by their codes, without PROJ's database of 9 MB."""

from __future__ import annotations

import json
from functools import lru_cache
from pathlib import Path

_TABLE = Path(__file__).with_name("epsg_lengths.json")


def epsg_length(code: int) -> float | None:
    """Metres of the unit of a projected or vertical system; None for a code that the table does not hold.

    Source: the EPSG dataset that the table names, written out by tools/epsg_table.py.
    """
    return next((metres for metres, runs in _runs() if any(a <= code <= b for a, b in runs)), None)


@lru_cache(maxsize=1)
def _runs() -> list[tuple[float, list[list[int]]]]:
    table = json.loads(_TABLE.read_text())
    return [(float(metres), runs) for metres, runs in table["metres"].items()]
