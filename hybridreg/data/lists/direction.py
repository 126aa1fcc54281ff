# SPDX-License-Identifier: MIT
"""Whether the poses of a data set map source to target or the other way round, by the overlap."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.geometry.fitness import measure
from hybridreg.pair import LabelledPair

Array = NDArray[np.float64]

PAIRS = 20
# More points than these change the overlap only in the third digit.
_SOURCE = 4_000
_TARGET = 60_000
# Below this the clouds hardly overlap in either direction.
_HARDLY = 0.02


class WrongDirection(ValueError):
    """The poses of a data set seem to map target to source."""


class Readable(Protocol):
    """Pairs that can be read without the check of this module."""

    overlap_radius: float

    def __len__(self) -> int: ...

    def read(self, index: int) -> LabelledPair: ...


@dataclass(frozen=True)
class Direction:
    """Mean overlap of `n` pairs under their poses, and under the inverses."""

    as_given: float
    inverted: float
    n: int
    radius: float

    @property
    def is_inverted(self) -> bool:
        """Whether the inverses fit better."""
        return self.inverted > self.as_given

    def __str__(self) -> str:
        return (
            f"mean overlap of {self.n} pairs at {self.radius:g} m: {self.as_given:.3f} under the poses "
            f"as given, {self.inverted:.3f} under their inverses"
        )


def overlap(labelled: LabelledPair, radius: float, *, inverted: bool = False) -> float:
    """Share of the source's points that the pose, or its inverse, brings within `radius` of the target."""
    pair, T = labelled.pair, labelled.T_target_source
    pose = lower_pose(se3.inverse(T) if inverted else T, pair)
    tree = cKDTree(_thinned(pair.target.points, _TARGET))
    return measure(_thinned(pair.source.points, _SOURCE), tree, pose, radius).fitness


def measured(pairs: Readable, n: int = PAIRS) -> Direction:
    """Overlaps both ways of up to `n` pairs, spread evenly over the set."""
    radius, both = pairs.overlap_radius, []
    for row in spread(len(pairs), n):
        labelled = pairs.read(row)
        both.append([overlap(labelled, radius), overlap(labelled, radius, inverted=True)])
    as_given, inverted = np.mean(both, axis=0)
    return Direction(float(as_given), float(inverted), len(both), radius)


def check(pairs: Readable, name: str, cure: str) -> None:
    """Refuse a set whose poses map target to source.

    Raises
    ------
    WrongDirection
        The inverses fit better; `cure` is what to do then.

    Warns
    -----
    UserWarning
        Neither fits.
    """
    found = measured(pairs)
    if found.is_inverted:
        raise WrongDirection(f"{name}: {found}; the poses seem to map target to source, {cure}")
    if found.as_given < _HARDLY:
        warnings.warn(
            f"{name}: {found}; the clouds hardly overlap, are the poses theirs?", UserWarning, stacklevel=3
        )


def spread(length: int, n: int) -> list[int]:
    """Up to `n` rows of `length`, evenly spread."""
    return [int(row) for row in np.unique(np.linspace(0, length - 1, min(n, length)).round())]


def _thinned(points: Array, most: int) -> Array:
    return points[:: max(1, len(points) // most)]
