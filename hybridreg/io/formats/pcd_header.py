# SPDX-License-Identifier: MIT
"""The header of a PCD file: its fields, their sizes, and how many points follow in which encoding."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from hybridreg.io.faults import fault, shorten
from hybridreg.io.record_fields import whole_number

_CODES = {
    **{("F", size): f"<f{size}" for size in (4, 8)},
    **{("I", size): f"<i{size}" for size in (1, 2, 4, 8)},
    **{("U", size): f"<u{size}" for size in (1, 2, 4, 8)},
}
_KEYWORDS = (
    "VERSION", "FIELDS", "COLUMNS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA",
)  # fmt: skip
_LARGEST_COUNT = 1_000_000
_ENCODINGS = ("ascii", "binary", "binary_compressed")


@dataclass(frozen=True, kw_only=True)
class PcdHeader:
    """`fields`, `codes` (numpy types) and `counts` (values of each field) have one entry a field."""

    fields: tuple[str, ...]
    codes: tuple[str, ...]
    counts: tuple[int, ...]
    points: int
    encoding: str
    body: int  # the first byte after the header
    viewpoint: tuple[float, float, float] | None  # the sensor's position; None where it is not given
    comments: tuple[str, ...] = ()

    @property
    def sizes(self) -> tuple[int, ...]:
        """Bytes of each field, all its values together."""
        return tuple(count * int(code[-1]) for code, count in zip(self.codes, self.counts, strict=True))


def parse_pcd_header(data: bytes, name: str) -> PcdHeader:
    """Read the header of the PCD file `data` called `name`."""
    entries, comments, body = _entries(data, name)
    fields = entries.get("FIELDS") or entries.get("COLUMNS") or []
    if not fields:
        raise fault(name, "its header has no FIELDS")
    encoding = " ".join(entries["DATA"]).lower()
    if encoding not in _ENCODINGS:
        raise fault(name, f"its DATA is {shorten(encoding)}, known are {', '.join(_ENCODINGS)}")
    if encoding == "ascii":  # where numbers have no size; klampt 0.10.1 gives none
        entries.setdefault("SIZE", ["8"] * len(fields))
    sizes = _per_field(entries, "SIZE", len(fields), name)
    types = _per_field(entries, "TYPE", len(fields), name)
    counts = _per_field(entries, "COUNT", len(fields), name) if "COUNT" in entries else ["1"] * len(fields)
    return PcdHeader(
        fields=tuple(fields),
        codes=tuple(_code(kind, size, name) for kind, size in zip(types, sizes, strict=True)),
        counts=tuple(_count(count, name) for count in counts),
        points=_points(entries, name),
        encoding=encoding,
        body=body,
        viewpoint=_viewpoint(entries.get("VIEWPOINT", []), name),
        comments=tuple(comments),
    )


def _entries(data: bytes, name: str) -> tuple[dict[str, list[str]], list[str], int]:
    entries: dict[str, list[str]] = {}
    comments: list[str] = []
    start = 0
    while "DATA" not in entries:
        newline = data.find(b"\n", start)
        if newline < 0:
            raise fault(name, f"its header has no DATA line in {len(data)} bytes")
        line = data[start:newline].decode("latin-1")
        start = newline + 1
        keyword, *values = line.split() or ["#"]
        if keyword.upper() in _KEYWORDS:
            entries[keyword.upper()] = values
        elif not keyword.startswith("#"):
            raise fault(name, f"its header has the unknown line {shorten(line)}")
        else:
            comments.append(line.lstrip("# "))
    return entries, comments, start


def _per_field(entries: dict[str, list[str]], keyword: str, fields: int, name: str) -> list[str]:
    values = entries.get(keyword, [])
    if len(values) != fields:
        raise fault(name, f"its header has {len(values)} values of {keyword} for {fields} FIELDS")
    return values


def _code(kind: str, size: str, name: str) -> str:
    code = _CODES.get((kind.upper(), int(size) if size in ("1", "2", "4", "8") else 0))
    if code is None:
        raise fault(name, f"a field has the unknown TYPE {shorten(kind)} with SIZE {shorten(size)}")
    return code


def _count(text: str, name: str) -> int:
    count = whole_number(text, name, "a COUNT")
    if count > _LARGEST_COUNT:
        raise fault(name, f"a field has the COUNT {count}, the largest descriptors have some thousands")
    return count


def _viewpoint(values: list[str], name: str) -> tuple[float, float, float] | None:
    # Translation and quaternion (w x y z) of the sensor in the frame of the points. Nearly every writer fills in the
    # origin by default, so that says nothing.
    try:
        x, y, z, *turn = (float(value) for value in values)
    except ValueError:
        if not values:
            return None
        raise fault(name, f"its VIEWPOINT is {shorten(' '.join(values))}, not seven numbers") from None
    if len(turn) not in (0, 4) or not all(isfinite(value) for value in (x, y, z, *turn)):
        raise fault(name, f"its VIEWPOINT is {shorten(' '.join(values))}, not seven finite numbers")
    return None if (x, y, z) == (0.0, 0.0, 0.0) else (x, y, z)


def _points(entries: dict[str, list[str]], name: str) -> int:
    numbers = {
        keyword: whole_number(" ".join(entries[keyword]), name, keyword)
        for keyword in ("WIDTH", "HEIGHT", "POINTS")
        if keyword in entries
    }
    if "WIDTH" not in numbers and "POINTS" not in numbers:
        raise fault(name, "its header has neither POINTS nor WIDTH")
    grid = numbers["WIDTH"] * numbers.get("HEIGHT", 1) if "WIDTH" in numbers else numbers["POINTS"]
    if numbers.get("POINTS", grid) != grid:
        raise fault(name, f"its header promises {numbers['POINTS']} POINTS, but WIDTH x HEIGHT is {grid}")
    return grid
