# SPDX-License-Identifier: MIT
"""Finding x, y and z among the fields of a record, and taking them out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, shorten
from hybridreg.io.meaning.downward import refuse_downward
from hybridreg.io.meaning.spherical import refuse_spherical

AXES = ("x", "y", "z")


def whole_number(text: str, name: str, what: str) -> int:
    """`text` as a count; a negative, fractional or absurdly long one is a `ValueError`."""
    if not (text.isascii() and text.isdigit() and len(text) <= 18):
        raise fault(name, f"{what} is {shorten(text)}, not a whole number")
    return int(text)


def axis_columns(fields: Sequence[str], name: str) -> tuple[int, int, int]:
    """Indices of x, y and z among `fields`, in upper or lower case."""
    lowered = [field.lower() for field in fields]
    if "x" not in lowered:
        refuse_spherical(fields, name)
    if "z" not in lowered:
        refuse_downward(fields, name)
    for axis in AXES:
        if lowered.count(axis) != 1:
            held = shorten(", ".join(fields), 200)
            problem = f"has {lowered.count(axis)} fields called {axis!r} among {held}"
            raise fault(name, problem, "name the coordinates x, y and z, each once")
    return lowered.index("x"), lowered.index("y"), lowered.index("z")


@dataclass(frozen=True, kw_only=True)
class XyzRecord:
    """Where x, y and z lie in a packed binary record of `size` bytes, and their numpy types.

    Offsets instead of a dtype with all names, because files repeat names (PCD's padding `_`) or omit them.
    """

    codes: tuple[str, str, str]
    offsets: tuple[int, int, int]
    size: int

    @classmethod
    def of(cls, codes: Sequence[str], sizes: Sequence[int], columns: tuple[int, int, int]) -> XyzRecord:
        starts = [0, *accumulate(sizes)]
        x, y, z = columns
        return cls(
            codes=(codes[x], codes[y], codes[z]), offsets=(starts[x], starts[y], starts[z]), size=starts[-1]
        )

    def points(self, data: bytes, start: int, count: int, name: str) -> NDArray[np.float64]:
        """The coordinates of `count` records that begin at byte `start`, shape (count, 3)."""
        held = max(len(data) - start, 0)
        if count * self.size > held:
            problem = f"its header promises {count} points of {self.size} bytes, it holds {held} bytes"
            raise fault(name, f"{problem} ({held // self.size} points)")
        if count == 0:
            return np.empty((0, 3))
        layout: Any = {"names": AXES, "formats": self.codes, "offsets": self.offsets, "itemsize": self.size}
        rows: NDArray[np.void] = np.frombuffer(data, dtype=np.dtype(layout), count=count, offset=start)
        return stack_axes(rows["x"], rows["y"], rows["z"])


def stack_axes(x: NDArray[np.generic], y: NDArray[np.generic], z: NDArray[np.generic]) -> NDArray[np.float64]:
    """Three columns of any real type as one (N, 3) float64 array."""
    points = np.empty((len(x), 3))
    with np.errstate(invalid="ignore"):  # a signalling NaN is a missing return like any other
        points[:, 0], points[:, 1], points[:, 2] = x, y, z
    return points
