# SPDX-License-Identifier: MIT
"""PCD files: x, y and z of each point, in any of the three encodings."""

from __future__ import annotations

from dataclasses import replace
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.arrays import TOGETHER
from hybridreg.io.coordinate_systems.length_unit import LengthUnit
from hybridreg.io.faults import fault
from hybridreg.io.formats.lzf import lzf_decompress
from hybridreg.io.formats.pcd_header import PcdHeader, parse_pcd_header
from hybridreg.io.formats.text_rows import parse_rows, promised_lines, text_lines
from hybridreg.io.meaning.unit_comments import as_commented, unit_in
from hybridreg.io.record_fields import XyzRecord, axis_columns, stack_axes

_MOST_EXPANSION = 88  # three bytes of LZF make at most 264


def parse_pcd(data: bytes, name: str) -> NDArray[np.float64]:
    """Read x, y and z of a PCD file: ascii, binary or binary_compressed; shape (N, 3), metres where a comment gives
    another unit.

    The points stay in the frame in which they are stored; VIEWPOINT, the sensor's position in it, is read by
    `pcd_viewpoint`. An organised cloud keeps its
    rows in order, empty pixels as NaN. Source: the Point Cloud Library's description of PCD 0.7.
    """
    header = parse_pcd_header(data, name)
    return as_commented(_points(data, header, name), header.comments, name)


def _points(data: bytes, header: PcdHeader, name: str) -> NDArray[np.float64]:
    together = _together(header)
    if together is not None and header.encoding == "binary_compressed":
        return _compressed_together(data, header, together, name)
    if together is not None:
        header = _apart(header, together)
    columns = axis_columns(header.fields, name)
    if any(header.counts[column] != 1 for column in columns):
        raise fault(name, "x, y or z has a COUNT other than 1", "export the file with one number for each")
    if header.encoding == "ascii":
        return _ascii_points(data, header, columns, name)
    if header.encoding == "binary":
        record = XyzRecord.of(header.codes, header.sizes, columns)
        return record.points(data, header.body, header.points, name)
    return _compressed_points(data, header, columns, name)


def _together(header: PcdHeader) -> int | None:
    """The one field that holds all three coordinates, such as `xyz` with COUNT 3; None where there is none."""
    lowered = [each.lower() for each in header.fields]
    fitting = [k for k, each in enumerate(lowered) if each in TOGETHER and header.counts[k] == 3]
    return fitting[0] if fitting and "x" not in lowered else None


def _apart(header: PcdHeader, k: int) -> PcdHeader:
    """The same layout with x, y and z for field `k`."""
    return replace(
        header,
        fields=(*header.fields[:k], "x", "y", "z", *header.fields[k + 1 :]),
        codes=(*header.codes[:k], *[header.codes[k]] * 3, *header.codes[k + 1 :]),
        counts=(*header.counts[:k], 1, 1, 1, *header.counts[k + 1 :]),
    )


def pcd_viewpoint(data: bytes, name: str) -> NDArray[np.float64] | None:
    """Where the sensor stood, (3,) among the points of `parse_pcd`; None where the header gives only the origin."""
    header = parse_pcd_header(data, name)
    if header.viewpoint is None:
        return None
    unit = unit_in(header.comments, name) or LengthUnit()
    return np.array(header.viewpoint) * (unit.across, unit.across, unit.up)


def _ascii_points(
    data: bytes, header: PcdHeader, columns: tuple[int, int, int], name: str
) -> NDArray[np.float64]:
    lines = promised_lines(text_lines(data[header.body :]), 0, header.points, sum(header.counts), name)
    places = [0, *accumulate(header.counts)]
    x, y, z = columns
    return parse_rows(lines, (places[x], places[y], places[z]), name)


def _compressed_points(
    data: bytes, header: PcdHeader, columns: tuple[int, int, int], name: str
) -> NDArray[np.float64]:
    if header.points == 0:
        return np.empty((0, 3))
    raw = _decompressed(data, header, sum(header.sizes), name)
    # All values of the first field come first, then all of the second.
    starts = [0, *accumulate(size * header.points for size in header.sizes)]
    x, y, z = (
        np.frombuffer(raw, dtype=header.codes[column], count=header.points, offset=starts[column])
        for column in columns
    )
    return stack_axes(x, y, z)


def _compressed_together(data: bytes, header: PcdHeader, k: int, name: str) -> NDArray[np.float64]:
    if header.points == 0:
        return np.empty((0, 3))
    raw = _decompressed(data, header, sum(header.sizes), name)
    start = sum(header.sizes[:k]) * header.points
    values = np.frombuffer(raw, dtype=header.codes[k], count=3 * header.points, offset=start)
    return stack_axes(*values.reshape(-1, 3).T)


def _decompressed(data: bytes, header: PcdHeader, point_size: int, name: str) -> bytes:
    body = data[header.body :]
    if len(body) < 8:
        raise fault(name, f"holds {len(body)} bytes after its header, the sizes of its data alone take 8")
    packed, unpacked = (int(number) for number in np.frombuffer(body, dtype="<u4", count=2))
    if unpacked != header.points * point_size:
        promise = f"its header promises {header.points} points of {point_size} bytes"
        raise fault(name, f"{promise}, its data announce {unpacked} bytes")
    if packed > len(body) - 8:
        raise fault(name, f"announces {packed} compressed bytes, it holds {len(body) - 8}")
    if unpacked > packed * _MOST_EXPANSION:
        raise fault(name, f"its {packed} compressed bytes cannot hold the {unpacked} bytes they announce")
    try:
        return lzf_decompress(body[8 : 8 + packed], unpacked)
    except ValueError as error:
        raise fault(name, str(error)) from error
