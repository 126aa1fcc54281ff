# SPDX-License-Identifier: MIT
from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridreg.io.formats.lzf import lzf_decompress


def compress(data: bytes) -> bytes:
    """A slow LZF compressor by the format's description: the longest earlier match, else a literal."""
    output, place = bytearray(), 0
    while place < len(data):
        length, distance = _longest_match(data, place)
        if length < 3:
            output += bytes([0, data[place]])
            place += 1
            continue
        short, far = length - 2, distance - 1
        head = [(short << 5) | (far >> 8)] if short < 7 else [(7 << 5) | (far >> 8), short - 7]
        output += bytes([*head, far & 255])
        place += length
    return bytes(output)


def _longest_match(data: bytes, place: int) -> tuple[int, int]:
    best = (0, 0)
    for start in range(max(0, place - 8192), place):
        length = 0
        while length < 264 and place + length < len(data) and data[start + length] == data[place + length]:
            length += 1
        best = max(best, (length, place - start))
    return best


@settings(max_examples=60, deadline=None)
@given(st.lists(st.sampled_from([b"a", b"bc", b"\x00" * 40, b"abcab", b"\xff"]), max_size=60).map(b"".join))
def test_what_was_compressed_comes_back(data):
    packed = compress(data)
    assert lzf_decompress(packed, len(data)) == data


def test_far_and_long_copies():
    data = bytes(range(256)) * 40 + b"\x00" * 1000
    packed = compress(data)
    assert len(packed) < len(data) / 10
    assert lzf_decompress(packed, len(data)) == data


def test_stream_written_by_hand():
    # Three literals "abc", then 9 bytes from 3 back (long form), then 3 bytes from 1 back (short form).
    assert lzf_decompress(b"\x02abc\xe0\x00\x02\x20\x00", 15) == b"abcabcabcabcccc"


@pytest.mark.parametrize(
    "packed, size, message",
    [
        (b"\x02abc", 4, "give 3 bytes instead of 4"),
        (b"\x02abc", 2, "instead of 2"),
        (b"\x05abc", 6, "give 3 bytes instead of 6"),
        (b"\x00a\x20", 4, "break off after 3 bytes"),
        (b"\x00a\xe0", 4, "break off after 3 bytes"),
        (b"\x00a\x20\x05", 4, "5 bytes before their beginning"),
    ],
)
def test_damaged_stream(packed, size, message):
    with pytest.raises(ValueError, match=message):
        lzf_decompress(packed, size)


def test_output_stops_at_the_promise():
    # Each copy makes 264 bytes: without the limit this would be 2.6 MB.
    with pytest.raises(ValueError, match="instead of 10"):
        lzf_decompress(b"\x00a" + b"\xe0\xff\x00" * 10_000, 10)
