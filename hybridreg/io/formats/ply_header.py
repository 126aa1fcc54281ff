# SPDX-License-Identifier: MIT
"""The header of a PLY file: which elements follow, and how each is laid out."""

from __future__ import annotations

from dataclasses import dataclass

from hybridreg.io.faults import fault, shorten
from hybridreg.io.record_fields import whole_number

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1",
    "short": "i2", "int16": "i2", "ushort": "u2", "uint16": "u2",
    "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "int64": "i8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass(frozen=True, kw_only=True)
class Property:
    """One value of an element, or a list of them preceded by its length."""

    name: str
    code: str  # numpy's type code without byte order, of the value or of the list's items
    length_code: str = ""  # of the list's length; empty for a plain value


@dataclass(frozen=True, kw_only=True)
class Element:
    """`count` rows of the same properties: the vertices, the faces, or whatever else a program added."""

    name: str
    count: int
    properties: tuple[Property, ...] = ()

    @property
    def has_lists(self) -> bool:
        return any(field.length_code for field in self.properties)


@dataclass(frozen=True, kw_only=True)
class PlyHeader:
    """Elements in file order, and the position of the first byte after the header."""

    order: str  # "<" or ">", empty for ascii
    elements: tuple[Element, ...]
    body: int
    comments: tuple[str, ...] = ()


def parse_ply_header(data: bytes, name: str) -> PlyHeader:
    """Read the header of the PLY file `data` called `name`."""
    lines, body = _header_lines(data, name)
    if not lines or lines[0].strip() != "ply":
        raise fault(name, f"begins with {shorten(data[:16])} instead of 'ply'", "check what file this is")
    order = ""
    seen_format = False
    elements: list[Element] = []
    comments: list[str] = []
    for line in lines[1:]:
        words = line.split()
        keyword = words[0] if words else "comment"
        if keyword == "format":
            order, seen_format = _byte_order(words, name), True
        elif keyword == "element":
            elements.append(_element(words, name))
        elif keyword == "property":
            _append_property(elements, words, name)
        elif keyword in ("comment", "obj_info"):
            comments.append(line.strip()[len(keyword) :].strip())
        else:
            raise fault(name, f"its header has the unknown line {shorten(line)}")
    if not seen_format:
        raise fault(name, "its header has no 'format' line")
    return PlyHeader(order=order, elements=tuple(elements), body=body, comments=tuple(comments))


def _header_lines(data: bytes, name: str) -> tuple[list[str], int]:
    # The first line shows how lines end, so that a binary body that begins with a newline byte is kept whole.
    ending = b"\r\n" if data.startswith(b"ply\r\n") else b"\r" if data.startswith(b"ply\r") else b"\n"
    stop = data.find(ending + b"end_header")
    if stop < 0:
        raise fault(name, f"its header has no 'end_header' in {len(data)} bytes")
    newline = data.find(ending[-1:], stop + len(ending))
    text = data[:stop].decode("latin-1")
    return text.split(ending.decode()), (newline + 1 if newline >= 0 else len(data))


def _byte_order(words: list[str], name: str) -> str:
    if len(words) < 2 or words[1] not in _FORMATS:
        raise fault(name, f"its format line is {shorten(' '.join(words))}, known are {', '.join(_FORMATS)}")
    return _FORMATS[words[1]]


def _element(words: list[str], name: str) -> Element:
    if len(words) != 3:
        raise fault(name, f"its header line {shorten(' '.join(words))} is not 'element NAME COUNT'")
    return Element(name=words[1], count=whole_number(words[2], name, f"its count of {shorten(words[1])}"))


def _append_property(elements: list[Element], words: list[str], name: str) -> None:
    if not elements:
        raise fault(name, f"its header line {shorten(' '.join(words))} stands before any element")
    last = elements[-1]
    elements[-1] = Element(
        name=last.name, count=last.count, properties=(*last.properties, _property(words, name))
    )


def _property(words: list[str], name: str) -> Property:
    is_list = words[1:2] == ["list"]
    first = 1 + is_list
    # CloudCompare's scalar fields have names of several words.
    types, label = words[first : first + 1 + is_list], " ".join(words[first + 1 + is_list :])
    codes = [_TYPES.get(word, "") for word in types]
    if not label or "" in codes or (is_list and codes[0].startswith("f")):
        problem = f"its header line {shorten(' '.join(words))} is not a property of a known type"
        raise fault(name, problem, f"known types are {', '.join(_TYPES)}")
    return Property(name=label, code=codes[-1], length_code=codes[0] if is_list else "")
