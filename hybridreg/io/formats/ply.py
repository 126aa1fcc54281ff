# SPDX-License-Identifier: MIT
"""PLY files: the coordinates of the `vertex` element, whatever comes before, beside or after them."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.formats.ply_header import Element, PlyHeader, Property, parse_ply_header
from hybridreg.io.formats.text_rows import parse_rows, promised_lines, text_lines
from hybridreg.io.meaning.unit_comments import as_commented
from hybridreg.io.record_fields import XyzRecord, axis_columns

_STRUCT_CODES = {"i1": "b", "u1": "B", "i2": "h", "u2": "H", "i4": "i", "u4": "I", "i8": "q", "u8": "Q",
                 "f4": "f", "f8": "d"}  # fmt: skip
# Surfaces of fewer vertices are seldom dense; by hand, a tenth of the points that other formats' surfaces give. A cloud
# of fewer points than the first is refused anyway.
_FEWEST, _DENSE = 20, 20_000
_PACKED = "packed_position"  # of SuperSplat's compressed files
SPLATS = "convert it to a plain .ply: splat-transform IN OUT.ply (npm install @playcanvas/splat-transform)"
"""What to do with compressed Gaussian splats."""
_EXPORT_CLOUD = "export the file with x, y and z as single numbers of each vertex"


def parse_ply(data: bytes, name: str) -> NDArray[np.float64]:
    """Read x, y and z of the vertices of a PLY file: ascii, little or big endian; shape (N, 3), metres where a
    comment gives another unit. Faces are left out, with a warning where the vertices are few.

    Source: Turk, "The PLY polygon file format" (1994).
    """
    header = parse_ply_header(data, name)
    _tell_faces(header, name)
    return as_commented(_points(data, header, name), header.comments, name)


def _points(data: bytes, header: PlyHeader, name: str) -> NDArray[np.float64]:
    before, vertex = _split_at_vertex(header, name)
    if any(field.name == _PACKED for field in vertex.properties):
        raise fault(name, "holds compressed Gaussian splats, whose positions are packed", SPLATS)
    columns = axis_columns([field.name for field in vertex.properties], name)
    if any(vertex.properties[column].length_code for column in columns):
        raise fault(name, "x, y or z of its vertices is a list", _EXPORT_CLOUD)
    if not header.order:
        return _ascii_vertices(data[header.body :], before, vertex, columns, name)
    start = header.body
    for element in before:
        start = _end_of(element, data, start, header.order, name)
    return _binary_vertices(data, start, header.order, vertex, columns, name)


def _tell_faces(header: PlyHeader, name: str) -> None:
    counts = {element.name.lower(): element.count for element in header.elements}
    vertices = counts.get("vertex", 0)
    # A closed surface of triangles has two for each vertex; a few faces beside a cloud are none.
    surface = 2 * counts.get("face", 0) > vertices or counts.get("tristrips", 0) > 0
    if surface and _FEWEST <= vertices < _DENSE:
        warnings.warn(
            f"{name}: it is a surface, of which the {vertices} vertices were read; where they do not lie densely on "
            "it, save it as .obj or .stl, of which the surface is read",
            UserWarning,
            stacklevel=3,
        )


def _split_at_vertex(header: PlyHeader, name: str) -> tuple[tuple[Element, ...], Element]:
    places = [k for k, element in enumerate(header.elements) if element.name.lower() == "vertex"]
    if len(places) > 1:
        counts = " and ".join(str(header.elements[k].count) for k in places[:5])
        raise fault(name, f"has {len(places)} elements 'vertex', of {counts} points", "export them as one")
    if places:
        return header.elements[: places[0]], header.elements[places[0]]
    names = ", ".join(element.name for element in header.elements[:10]) or "nothing"
    raise fault(name, f"has no element 'vertex', only {names}", "export the file with its vertices")


def _ascii_vertices(
    body: bytes, before: tuple[Element, ...], vertex: Element, columns: tuple[int, int, int], name: str
) -> NDArray[np.float64]:
    lines = text_lines(body)
    start = sum(element.count for element in before if element.properties)
    rows = promised_lines(lines, start, vertex.count, len(vertex.properties), name)
    if any(field.length_code for field in vertex.properties[: max(columns)]):
        rows = [_without_lists(row, vertex, name) for row in rows]
    return parse_rows(rows, columns, name)


def _without_lists(row: str, vertex: Element, name: str) -> str:
    # A list before x moves x to another place in each row; one word in its place restores the columns.
    words = row.split()
    kept: list[str] = []
    place = 0
    for field in vertex.properties:
        kept.extend(words[place : place + 1])
        if field.length_code and (not kept or not kept[-1].isdecimal()):
            raise fault(name, f"a list in the row {row[:60]!r} has no length")
        place += 1 + (int(kept[-1]) if field.length_code else 0)
    return " ".join(kept)


def _end_of(element: Element, data: bytes, start: int, order: str, name: str) -> int:
    end = start
    if element.has_lists:
        for places in _walk(element, data, start, order, name):
            end = places[-1]
    else:
        end = start + element.count * sum(int(field.code[1]) for field in element.properties)
    if end > len(data):
        promise = f"{element.count} rows of {element.name[:40]!r}"
        raise fault(name, f"its header promises {promise} up to byte {end}, it holds {len(data)} bytes")
    return end


def _binary_vertices(
    data: bytes, start: int, order: str, vertex: Element, columns: tuple[int, int, int], name: str
) -> NDArray[np.float64]:
    if not vertex.has_lists:
        codes = [order + field.code for field in vertex.properties]
        sizes = [int(field.code[1]) for field in vertex.properties]
        return XyzRecord.of(codes, sizes, columns).points(data, start, vertex.count, name)
    readers = [_reader(order, vertex.properties[column].code) for column in columns]
    rows = [
        [reader.unpack_from(data, places[column])[0] for reader, column in zip(readers, columns, strict=True)]
        for places in _walk(vertex, data, start, order, name)
    ]
    return np.array(rows, dtype=np.float64).reshape(-1, 3)


def _walk(element: Element, data: bytes, start: int, order: str, name: str) -> Iterator[list[int]]:
    """For each row, the byte where each property begins, and the byte after the row.

    Row by row in Python, for rows of unequal length only. It stops at the first row that leaves the file, so an absurd
    count in the header does no harm.
    """
    for row in range(element.count):
        places = [start]
        for field in element.properties:
            start += _size(field, data, start, order, name)
            places.append(start)
        if start > len(data):
            promise = f"{element.count} rows of {element.name[:40]!r}"
            raise fault(name, f"its header promises {promise}, its {len(data)} bytes end in row {row + 1}")
        yield places


def _size(field: Property, data: bytes, start: int, order: str, name: str) -> int:
    size = int(field.code[1])
    if not field.length_code:
        return size
    reader = _reader(order, field.length_code)
    if start + reader.size > len(data):
        return reader.size  # the row's end is found to lie beyond the file
    length: int = reader.unpack_from(data, start)[0]
    if length < 0:
        raise fault(name, f"a list {field.name[:40]!r} at byte {start} has the length {length}")
    return reader.size + length * size


def _reader(order: str, code: str) -> struct.Struct:
    return struct.Struct(order + _STRUCT_CODES[code])
