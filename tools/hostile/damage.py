# SPDX-License-Identifier: MIT
"""Damage to bytes: truncation, flipped bits, pieces lost, doubled or overwritten, numbers replaced."""

from __future__ import annotations

import re
from typing import Any

from hypothesis import strategies as st

Damage = tuple[Any, ...]

# Mostly near the beginning, where the headers are.
_PLACES = st.one_of(st.integers(0, 300), st.integers(0, 5000), st.integers(-200, -1))
_NUMBERS = ("0", "-1", "1", "3", "255", "65536", "2147483648", "4294967295", "18446744073709551616",
            "1e400", "nan", "99999999999999999999999999", "0x10", "1_000", "٣")  # fmt: skip


def damages() -> st.SearchStrategy[tuple[Damage, ...]]:
    """Up to three kinds of damage, possibly none."""
    return st.lists(
        st.one_of(
            st.tuples(st.just("cut"), _PLACES),
            st.tuples(st.just("flip"), _PLACES, st.integers(0, 7)),
            st.tuples(st.just("set"), _PLACES, st.integers(0, 255)),
            st.tuples(st.just("drop"), _PLACES, st.integers(1, 64)),
            st.tuples(st.just("double"), _PLACES, st.integers(1, 64)),
            st.tuples(st.just("insert"), _PLACES, st.binary(min_size=1, max_size=16)),
            st.tuples(st.just("number"), st.integers(0, 30), st.sampled_from(_NUMBERS)),
        ),
        max_size=3,
    ).map(tuple)


def damaged(data: bytes, damage: tuple[Damage, ...]) -> bytes:
    """The bytes after all of the damage."""
    for kind, place, *rest in damage:
        if kind == "number":
            data = _other_number(data, place, rest[0].encode())
            continue
        at = place % len(data) if data else 0
        if kind == "cut":
            data = data[:at]
        elif kind == "flip" and data:
            data = data[:at] + bytes([data[at] ^ (1 << rest[0])]) + data[at + 1 :]
        elif kind == "set" and data:
            data = data[:at] + bytes(rest) + data[at + 1 :]
        elif kind == "drop":
            data = data[:at] + data[at + rest[0] :]
        elif kind == "double":
            data = data[: at + rest[0]] + data[at:]
        elif kind == "insert":
            data = data[:at] + rest[0] + data[at:]
    return data


def _other_number(data: bytes, index: int, number: bytes) -> bytes:
    found = list(re.finditer(rb"-?\d[\d.]*", data[:2000]))
    if not found:
        return data
    match = found[index % len(found)]
    return data[: match.start()] + number + data[match.end() :]
