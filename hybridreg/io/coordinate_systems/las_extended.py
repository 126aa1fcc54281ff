# SPDX-License-Identifier: MIT
"""A coordinate reference system behind the points of a LAS 1.4 file, in its extended variable length records.

Read without laspy, which believes the length that a damaged record claims.
"""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from hybridreg.io.coordinate_systems.las_units import WELL_KNOWN_TEXT
from hybridreg.io.faults import fault

_PROJECTION = "LASF_Projection"  # who defines the records that tell of a system
_PLACE_AND_COUNT = (
    235  # where LAS 1.4 keeps the first record's place, in 8 bytes, and how many there are, in 4
)
_HEADER = 60  # bytes before the content of each
_NEEDED = 247  # bytes of the file's header that tell of them


@dataclass(frozen=True, kw_only=True)
class TextRecord:
    """A record of well-known text, with the names that laspy gives its parts."""

    record_id: int
    string: str


def extended_records(data: bytes, name: str) -> Iterator[TextRecord]:
    """Records of well-known text behind the points of a file's content `data`.

    Source: ASPRS, LAS Specification 1.4-R15, section 2.7.

    Raises
    ------
    ValueError
        The file ends before the records that its header promises.
    """
    if len(data) < _NEEDED or data[25] < 4:
        return
    place, count = struct.unpack_from("<QI", data, _PLACE_AND_COUNT)
    for _ in range(count):
        if place + _HEADER > len(data):
            raise _cut_off(name, count, place + _HEADER, data)
        user, record_id, length = struct.unpack_from("<16sHQ", data, place + 2)
        content, place = place + _HEADER, place + _HEADER + length
        if place > len(data):
            raise _cut_off(name, count, place, data)
        if record_id == WELL_KNOWN_TEXT and user.startswith(_PROJECTION.encode()):
            yield TextRecord(record_id=record_id, string=data[content:place].decode("utf-8", "replace"))


def records_of_header(header: Any, name: str) -> list[Any]:
    """All records that a header of laspy holds, those behind the points among them; warns where these were not read and
    the others do not tell the coordinate system."""
    behind = getattr(header, "evlrs", None)
    records = [*header.vlrs, *(behind or ())]
    left = 0 if behind is not None else int(getattr(header, "number_of_evlrs", 0) or 0)
    if left and not any(getattr(record, "user_id", "") == _PROJECTION for record in records):
        warnings.warn(
            f"{name}: {left} records behind its points were not read, and its unit may stand there; it was taken for "
            "metres: read it with laspy.read",
            UserWarning,
            stacklevel=3,
        )
    return records


def _cut_off(name: str, count: int, end: int, data: bytes) -> ValueError:
    return fault(name, f"its header promises {count} records up to byte {end}, it holds {len(data)} bytes")
