# SPDX-License-Identifier: MIT
"""Whether the poses of a data set map source to target or the other way round, by the overlap."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.geometry.extent import sample
from hybridreg.geometry.fitness import measure
from hybridreg.pair import LabelledPair

Array = NDArray[np.float64]

# Pairs that are read where the direction is not certain, and where it should be.
PAIRS, A_FEW = 20, 8
CURE = "invert them: they must map source points to target points"
# More points than these change the overlap only in the third digit.
_SOURCE = 4_000
_TARGET = 60_000
# Below this the clouds hardly overlap in either direction.
_HARDLY = 0.02
# A pose fits far better than its inverse where it covers so many times as much, and so much more. Of right poses, 18
# real and 40 simulated pairs of five tiers, none fits far worse; two thirds and more fit far better.
_TIMES, _MORE = 2.0, 0.1
# Share of the pairs that must tell, so that a few odd ones do not speak for all.
_TELLING = 0.25


class WrongDirection(ValueError):
    """The poses of a data set seem to map target to source."""


class Readable(Protocol):
    """Pairs that can be read without the check of this module."""

    @property
    def overlap_radius(self) -> float: ...

    def __len__(self) -> int: ...

    def read(self, index: int) -> LabelledPair: ...


@dataclass(frozen=True)
class Direction:
    """Mean overlap of `n` pairs under their poses, and under the inverses; how many fit far better one way."""

    as_given: float
    inverted: float
    n: int
    radius: float
    n_given: int = 0
    n_inverted: int = 0

    @classmethod
    def of(cls, both: Sequence[tuple[float, float]], radius: float) -> Direction:
        """Of each pair's overlap under its pose and under the inverse."""
        given, inverted = np.array(both, dtype=np.float64).T
        return cls(
            float(given.mean()),
            float(inverted.mean()),
            len(both),
            radius,
            int(far_better(given, inverted).sum()),
            int(far_better(inverted, given).sum()),
        )

    @property
    def is_inverted(self) -> bool:
        """Whether the inverses fit better."""
        return self.inverted > self.as_given

    @property
    def is_clearly_inverted(self) -> bool:
        """Whether most pairs that tell anything fit far better under the inverses; for sets in which some pairs have
        nothing in common, or move so little that nothing can be told."""
        return self.n_inverted > self.n_given and self.n_inverted + self.n_given >= _TELLING * self.n

    def __str__(self) -> str:
        return (
            f"mean overlap of {self.n} pairs at {self.radius:g} m: {self.as_given:.3f} under the poses "
            f"as given, {self.inverted:.3f} under their inverses"
        )


def overlap(labelled: LabelledPair, radius: float, *, inverted: bool = False) -> float:
    """Share of the source's points that the pose, or its inverse, brings within `radius` of the target."""
    pair, T = labelled.pair, labelled.T_target_source
    pose = lower_pose(se3.inverse(T) if inverted else T, pair)
    tree = cKDTree(sample(pair.target.points, _TARGET))
    return measure(sample(pair.source.points, _SOURCE), tree, pose, radius).fitness


def measured(pairs: Readable, n: int = PAIRS) -> Direction:
    """Overlaps both ways of up to `n` pairs, spread evenly over the set."""
    radius = pairs.overlap_radius
    both: list[tuple[float, float]] = []
    problem: Exception | None = None
    for row in spread(len(pairs), n):
        try:
            labelled = pairs.read(row)
        except (OSError, ValueError) as error:  # told where it is read; the others speak all the same
            problem = error
            continue
        both.append((overlap(labelled, radius), overlap(labelled, radius, inverted=True)))
    if not both and problem is not None:
        raise problem
    return Direction.of(both, radius)


def far_better(one: Array, other: Array) -> NDArray[np.bool_]:
    """Which poses cover far more of the source than others, by their overlaps."""
    return np.asarray((one >= _TIMES * other) & (one >= other + _MORE))


def check(pairs: Readable, name: str, cure: str, *, n: int = PAIRS, clearly: bool = False) -> None:
    """Refuse a set whose poses map target to source.

    Parameters
    ----------
    n : pairs to read
    clearly : only where most pairs fit far better that way

    Raises
    ------
    WrongDirection
        The inverses fit better; `cure` is what to do then.

    Warns
    -----
    UserWarning
        Neither fits.
    """
    found = measured(pairs, n)
    if found.is_clearly_inverted if clearly else found.is_inverted:
        raise WrongDirection(f"{name}: {found}; the poses seem to map target to source, {cure}")
    if found.as_given < _HARDLY:
        warnings.warn(
            f"{name}: {found}; the clouds hardly overlap: are the poses theirs, and in metres?",
            UserWarning,
            stacklevel=3,
        )


def spread(length: int, n: int) -> list[int]:
    """Up to `n` rows of `length`, evenly spread."""
    return [int(row) for row in np.unique(np.linspace(0, length - 1, min(n, length)).round())]
