# SPDX-License-Identifier: MIT
"""Numbers with their noun in the right form."""

from __future__ import annotations


def number_of(n: int, noun: str, plural: str = "") -> str:
    """`1 pair`, `2 pairs`, `0 entries`; `plural` where it is more than the noun and an s."""
    return f"{n} {noun if n == 1 else plural or noun + 's'}"
