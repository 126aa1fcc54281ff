# SPDX-License-Identifier: MIT
"""Our own split of data sets that publish none: by the last digit of a drive's or a sequence's number."""

from __future__ import annotations

SPLITS = ("train", "val", "test", "all")


def split_of(name: str, without: str = "") -> str:
    """Ends with 0 or 5: "test", with 9: "val", with another digit: "train"; `without` where it ends with none."""
    last = name[-1:]
    if not last.isdecimal():
        return without
    return "test" if last in "05" else "val" if last == "9" else "train"


def check_split(split: str, title: str) -> None:
    """Refuse what is no split; "all" is one.

    Raises
    ------
    ValueError
        Listing the splits of the data set called ``title``.
    """
    if split not in SPLITS:
        raise ValueError(f"split={split!r}: {title} has {', '.join(SPLITS)}")
