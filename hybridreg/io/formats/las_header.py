# SPDX-License-Identifier: MIT
"""What a LAS header promises, checked against the file before laspy believes it.

laspy loops over the promised number of records and allocates the promised points; lazrs, behind it, allocates
the promised table of chunks and ends the whole process when it cannot. One damaged byte would be enough.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from hybridreg.io.faults import fault

_SMALLEST_HEADER = 227  # bytes, LAS 1.0 to 1.2
_RECORD_HEADER = 54  # bytes before the content of each variable length record
_COUNT_OF_1_4 = 247  # where LAS 1.4 keeps its count of points, in 8 bytes
_COMPRESSED = 0x80  # LAZ sets this bit in the point format


@dataclass(frozen=True, kw_only=True)
class LasPromise:
    """How many points of how many bytes follow (in LAZ, once decompressed)."""

    points: int
    point_size: int


def check_las_header(data: bytes, name: str) -> LasPromise:
    """Refuse a header that promises more than the file `data` holds.

    Source: ASPRS, LAS Specification 1.4-R15, table 3 (public header block).
    """
    if len(data) < _SMALLEST_HEADER:
        raise fault(name, f"holds {len(data)} bytes, a LAS header alone takes {_SMALLEST_HEADER}")
    size, start, records, point_format, point_size, points = struct.unpack_from("<HIIBHI", data, 94)
    if data[25] >= 4:
        points = int.from_bytes(data[_COUNT_OF_1_4 : _COUNT_OF_1_4 + 8], "little")
    if start > len(data):
        raise fault(name, f"its points should begin at byte {start}, it holds {len(data)} bytes")
    if records * _RECORD_HEADER > max(start - size, 0):
        room = f"{start - size} bytes before the points"
        raise fault(name, f"its header promises {records} records in the {room}")
    held = len(data) - start
    if point_size == 0 or (not point_format & _COMPRESSED and points * point_size > held):
        raise fault(name, f"its header promises {points} points of {point_size} bytes, it holds {held} bytes")
    if point_format & _COMPRESSED and points:
        _check_chunk_table(data, start, point_size, name)
    return LasPromise(points=points, point_size=point_size)


def _check_chunk_table(data: bytes, start: int, point_size: int, name: str) -> None:
    """Refuse a LAZ chunk table that is missing, or that lists more chunks than the file has room for.

    Source: the LASzip format. The data begin with the table's position (-1: the position is in the last 8 bytes); the
    table begins with a version and its length. A chunk begins with one point that is not compressed.
    """
    place = int.from_bytes(data[start : start + 8], "little", signed=True)
    if place == -1:
        place = int.from_bytes(data[-8:], "little", signed=True)
    if not start + 8 <= place <= len(data) - 8:
        raise fault(name, f"its table of chunks should lie at byte {place}, it holds {len(data)} bytes")
    chunks = int.from_bytes(data[place + 4 : place + 8], "little")
    if chunks * point_size > place - start - 8:
        room = f"{place - start - 8} bytes"
        raise fault(
            name, f"its table lists {chunks} chunks of at least {point_size} bytes, it holds {room} of them"
        )
