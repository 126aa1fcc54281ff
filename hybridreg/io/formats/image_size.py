# SPDX-License-Identifier: MIT
"""The number of pixels of an image from its header: a decoder allocates them all before it can be stopped."""

from __future__ import annotations

import re
import struct
from collections.abc import Callable

Size = tuple[int, int]  # rows, columns


def image_size(data: bytes) -> Size | None:
    """Rows and columns of the image in `data`; None where OpenCV does not decode such files, or the file is truncated.

    Source: the headers as their formats' specifications give them (PNG, JPEG, TIFF 6, BMP, WebP, GIF, JPEG 2000, AVIF,
    Netpbm, Radiance, OpenEXR, Sun raster).
    """
    for signature, reader in _READERS:
        if re.match(signature, data[:16], re.DOTALL):
            try:
                return reader(data)
            except (struct.error, ValueError, IndexError):
                return None
    return None


def _png(data: bytes) -> Size:
    columns, rows = struct.unpack_from(">II", data, 16)
    return rows, columns


def _jpeg(data: bytes) -> Size:
    place = 2
    while data[place] == 0xFF:
        marker = data[place + 1]
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):  # start of frame
            rows, columns = struct.unpack_from(">HH", data, place + 5)
            return rows, columns
        place += 1 if marker == 0xFF else 2 + int.from_bytes(data[place + 2 : place + 4], "big")
    raise ValueError("no frame")


def _bmp(data: bytes) -> Size:
    if struct.unpack_from("<I", data, 14)[0] == 12:
        columns, rows = struct.unpack_from("<HH", data, 18)
    else:
        columns, rows = struct.unpack_from("<ii", data, 18)
    return abs(rows), abs(columns)


def _webp(data: bytes) -> Size:
    kind = data[12:16]
    if kind == b"VP8X":
        columns, rows = (1 + int.from_bytes(data[k : k + 3], "little") for k in (24, 27))
    elif kind == b"VP8L":
        bits = struct.unpack_from("<I", data, 21)[0]
        columns, rows = 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    else:
        columns, rows = (side & 0x3FFF for side in struct.unpack_from("<HH", data, 26))
    return rows, columns


def _gif(data: bytes) -> Size:
    columns, rows = struct.unpack_from("<HH", data, 6)
    return rows, columns


def _tiff(data: bytes) -> Size:
    order = "<" if data[:2] == b"II" else ">"
    big = struct.unpack_from(f"{order}H", data, 2)[0] == 43
    start = struct.unpack_from(f"{order}{'Q' if big else 'I'}", data, 8 if big else 4)[0]
    count = struct.unpack_from(f"{order}{'Q' if big else 'H'}", data, start)[0]
    start += 8 if big else 2
    sides: dict[int, int] = {}
    for entry in range(min(count, 4096)):
        place = start + entry * (20 if big else 12)
        tag, kind = struct.unpack_from(f"{order}HH", data, place)
        if tag in (256, 257):  # width and length, in 2, 4 or 8 bytes
            code = {3: "H", 4: "I", 16: "Q"}[kind] if kind in (3, 4, 16) else "I"
            sides[tag] = struct.unpack_from(order + code, data, place + (12 if big else 8))[0]
    if len(sides) < 2:
        raise ValueError("no size")
    return sides[257], sides[256]


def _jpeg_2000(data: bytes) -> Size:
    # The size in the stream itself: the box around it may give another.
    columns, rows = struct.unpack_from(">II", data, data.index(b"\xff\x4f\xff\x51") + 8)
    return rows, columns


def _avif(data: bytes) -> Size:
    # The largest of the images in it, which may be the tiles of one.
    found = [struct.unpack(">II", sides) for sides in re.findall(rb"ispe\0\0\0\0(.{8})", data, re.DOTALL)]
    columns, rows = max(found, key=lambda sides: sides[0] * sides[1])
    return rows, columns


def _netpbm(data: bytes) -> Size:
    if data[:2] == b"P7":
        sides = {word: int(number) for word, number in re.findall(rb"\n(HEIGHT|WIDTH) (\d+)", data[:4096])}
        if len(sides) < 2:
            raise ValueError("no size")
        return sides[b"HEIGHT"], sides[b"WIDTH"]
    words = re.sub(rb"#[^\n]*\n", b" ", data[2:4096]).split(maxsplit=2)
    return int(words[1]), int(words[0])


def _radiance(data: bytes) -> Size:
    found = re.search(rb"[-+]([XY]) (\d+) [-+]([XY]) (\d+)", data[:65536])
    if found is None:
        raise ValueError("no size")
    return int(found[2]), int(found[4])


def _openexr(data: bytes) -> Size:
    place = data.index(b"dataWindow\x00box2i\x00") + len(b"dataWindow\x00box2i\x00") + 4
    left, top, right, bottom = struct.unpack_from("<iiii", data, place)
    return bottom - top + 1, right - left + 1


def _sun(data: bytes) -> Size:
    columns, rows = struct.unpack_from(">II", data, 4)
    return rows, columns


_READERS: tuple[tuple[bytes, Callable[[bytes], Size]], ...] = (
    (rb"\x89PNG\r\n\x1a\n", _png),
    (rb"\xff\xd8\xff", _jpeg),
    (rb"BM", _bmp),
    (rb"RIFF....WEBP", _webp),
    (rb"GIF8", _gif),
    (rb"II[\x2a\x2b]\x00|MM\x00[\x2a\x2b]", _tiff),
    (rb"....jP  |\xff\x4f\xff\x51", _jpeg_2000),
    (rb"....ftyp(avif|avis|mif1|heic)", _avif),
    (rb"P[1-7Ff]\s", _netpbm),
    (rb"#\?", _radiance),
    (rb"\x76\x2f\x31\x01", _openexr),
    (rb"\x59\xa6\x6a\x95", _sun),
)
