# SPDX-License-Identifier: MIT
"""Which cloud of a file that holds several, and what a reader of one gives back."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, fields
from numbers import Integral, Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault

_NANOSECONDS = 1e9
Array = NDArray[np.float64]

RECOVER = "run `mcap recover` on it"
"""What to do with an MCAP file whose recording was cut off."""

CLOUDS_OF_ROS = "PointCloud2, PointCloud, LaserScan and Livox's CustomMsg"
"""What is read of messages of ROS."""


@dataclass(frozen=True, kw_only=True)
class Selection:
    """Which cloud of a file.

    Parameters
    ----------
    topic : str or None
        Of a bag; None takes its only topic of clouds.
    index : int or None
        Counted from 0: the message of a bag, the scan of an E57 file, the frame of an LVX2 file; negative from the end.
    at : float or None
        Seconds after the bag's first message: the first cloud from then on.
    accumulate : int
        So many clouds that follow one another are laid together as they are: for a sensor that stood still (a Livox
        needs a second to fill its view), as nobody tells how it moved.

    Raises
    ------
    ValueError
        `index` and `at` together, no whole number, or a count below one.
    """

    topic: str | None = None
    index: int | None = None
    at: float | None = None
    accumulate: int = 1

    def __post_init__(self) -> None:
        if self.index is not None and self.at is not None:
            raise ValueError(f"index={self.index} and at={self.at}: leave one of them out")
        if self.index is not None and (isinstance(self.index, bool) or not isinstance(self.index, Integral)):
            raise ValueError(f"index={self.index!r} must be a whole number, 0 for the first")
        if self.at is not None and (
            isinstance(self.at, bool) or not (isinstance(self.at, Real) and 0.0 <= self.at < np.inf)
        ):
            raise ValueError(f"at={self.at!r} must be seconds after the start, 0 or more")
        if (
            isinstance(self.accumulate, bool)
            or not isinstance(self.accumulate, Integral)
            or self.accumulate < 1
        ):
            raise ValueError(f"accumulate={self.accumulate!r} must be a whole number, 1 or more")

    def made(self) -> dict[str, Any]:
        """What was chosen, by the names above."""
        return {
            each.name: value for each in fields(self) if (value := getattr(self, each.name)) != each.default
        }

    def first_of(self, count: int, name: str, what: str) -> int:
        """The row that `index` means among `count`, with `accumulate` of them from there on.

        Raises
        ------
        ValueError
            There are not so many.
        """
        index = self.index or 0
        first = index + count if index < 0 else index
        if not 0 <= first < count or first + self.accumulate > count:
            asked = f"index {index}" + (f" and {self.accumulate - 1} after it" if self.accumulate > 1 else "")
            raise fault(name, f"holds {count} {what}, {asked} was asked for", f"choose from 0 to {count - 1}")
        return first

    def begin(self, start: int) -> int:
        """From when on clouds count, nanoseconds, in a recording that starts at `start`."""
        return start + int((self.at or 0.0) * _NANOSECONDS)

    def check_enough(self, held: int, start: int, end: int, name: str) -> None:
        """Refuse where fewer clouds are there than were asked for, in a recording from `start` to `end`, nanoseconds.

        Raises
        ------
        ValueError
            There are fewer.
        """
        if held < self.accumulate:
            problem = f"holds {held} clouds of this topic from {self.at or 0:g} s on"
            cure = f"it lasts {(end - start) / _NANOSECONDS:.1f} s, choose an earlier time"
            raise fault(name, f"{problem}, {self.accumulate} were asked for", cure)


ANY = Selection()


def chosen_topic(
    counts: Mapping[str, int],
    asked: str | None,
    others: Iterable[str],
    name: str,
    cure: str,
    flat: Collection[str] = (),
) -> str:
    """The topic whose clouds are read, by the number of clouds of each; `others` are the kinds of what else there is,
    `flat` the topics of 2-D scanners: beside clouds in space they are read where they are asked for.

    Raises
    ------
    ValueError
        There is none, the one asked for is not among them, or there are several and none was asked for.
    """
    told = ", ".join(f"{each} ({counts[each]})" for each in sorted(counts))
    if not counts:
        rest = ", ".join(sorted(set(others))[:8]) or "nothing at all"
        raise fault(name, f"holds no clouds, but {rest}", cure)
    if asked is not None:
        if asked not in counts:
            raise fault(name, f"holds no clouds of the topic {asked!r}", f"it has {told}")
        return asked
    likely = [each for each in counts if each not in flat] or list(counts)
    if len(likely) > 1:
        raise fault(name, f"holds clouds of {len(counts)} topics: {told}", 'choose one with topic="..."')
    return likely[0]


class Recorded(NamedTuple):
    """A cloud as its file tells it.

    points : (N, 3) float64, metres
    places : (k, 3) where it was seen from, in the same frame; none for what nobody saw (a mesh); None where the file
        does not tell
    of_point : (N,) row of each point's place, where there are several
    holed : whether missing returns are part of the format, so that they are left out without being asked
    guess : (3,) where its sensor may have stood, to be tested like an origin
    corners : (n, 3) of a surface, over which the points were spread, all or some: they have the digits of the file
    """

    points: Array
    places: Array | None = None
    of_point: NDArray[np.int64] | None = None
    holed: bool = False
    guess: Array | None = None
    corners: Array | None = None


def check_filled(recorded: Recorded, name: str) -> Recorded:
    """The clouds of a recording, in which the first message is often empty.

    Raises
    ------
    ValueError
        They hold no points.
    """
    if not len(recorded.points):
        raise fault(name, "the cloud chosen from it is empty", "choose another index")
    return recorded
