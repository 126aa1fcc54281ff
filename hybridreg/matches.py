# SPDX-License-Identifier: MIT
"""What the stages hand to one another: overlap, correspondences, pose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Overlap:
    """Probability of each downsampled point to lie in the part that both sensors saw.

    Attributes
    ----------
    source : (n,) float64 in [0, 1]
    target : (m,) float64 in [0, 1]
    """

    source: Array
    target: Array

    @classmethod
    def full(cls, n_source: int, n_target: int) -> Overlap:
        """Every point counts: what a pipeline without an overlap stage uses."""
        return cls(np.ones(n_source), np.ones(n_target))


@dataclass(frozen=True, eq=False)
class Described:
    """Points of one cloud and what a matcher knows of each.

    Attributes
    ----------
    points : (n, 3) float64
        Metres, in the cloud's frame.
    features : (n, d) float32
        Of length one; two points look alike where their product is near one.
    """

    points: Array
    features: NDArray[np.float32]


@dataclass(frozen=True, eq=False, kw_only=True)
class Correspondences:
    """Pairs of points held to be the same place.

    Attributes
    ----------
    source, target : (K, 3) float64
        Coordinates in metres, each in its cloud's frame.
    weight : (K,) float64, not negative
    group : (K,) int64 or None
        The superpoint pair that a match came from; local-to-global estimation needs it.
    source_index, target_index : (K,) int64 or None
        Rows of the levels' points, where the matches are such.
    spacing : float or None
        Typical distance of the points among which partners were sought, metres: no match can be nearer to right.
        None means the scene's own; a network that works on a grid of its own tells that grid's.
    described : (Described, Described) or None
        All points of source and target among which partners were sought; guided matching needs them.
    """

    source: Array
    target: Array
    weight: Array
    group: Indices | None = None
    source_index: Indices | None = None
    target_index: Indices | None = None
    spacing: float | None = None
    described: tuple[Described, Described] | None = None

    def __post_init__(self) -> None:
        n = len(self.source)
        for name in ("source", "target", "weight", "group", "source_index", "target_index"):
            column = getattr(self, name)
            expected = (n, 3) if name in ("source", "target") else (n,)
            if column is not None and column.shape != expected:
                raise ValueError(f"matches: {name} has shape {column.shape}, expected {expected}")

    def __len__(self) -> int:
        return len(self.source)

    @classmethod
    def of(cls, source: Any, target: Any, weight: Any = None) -> Correspondences:
        """Matches from two arrays (K, 3) of coordinates, and weights (K,) that default to one."""
        source = np.asarray(source, dtype=np.float64)
        weight = np.ones(len(source)) if weight is None else np.asarray(weight, dtype=np.float64)
        return cls(source=source, target=np.asarray(target, dtype=np.float64), weight=weight)

    @classmethod
    def none(cls) -> Correspondences:
        """No matches at all."""
        return cls(source=np.zeros((0, 3)), target=np.zeros((0, 3)), weight=np.zeros(0))


# Elements of two matrices of one pose differ by less: rounding, when a rotation is made exact.
_SAME = 1e-9


class EntryTrace(NamedTuple):
    """What one entry of several did for a pose.

    Attributes
    ----------
    entry : the short names of its stages
    seconds : wall time, with settling and refining what it offered
    poses : how many poses it offered
    log_odds : that its best is right, were there no other; None where it offered none
    problem : why it could not run; None where it did
    won : the pose is its own
    """

    entry: str
    seconds: float
    poses: int
    log_odds: float | None
    problem: str | None = None
    won: bool = False


@dataclass(frozen=True, eq=False)
class Pose:
    """An estimated pose.

    Attributes
    ----------
    T : (4, 4) float64
        Maps source to target.
    inliers : (K,) bool or None
        Which matches agree with it.
    rivals : (r, 4, 4) float64
        Other poses that the data nearly supports, best first.
    found : bool
        False where the stage had nothing to work with and T is only a placeholder (the identity).
    found_by : int
        Methods that came to T independently of one another.
    hypotheses : tuple
        What the estimator knows about T and each of the rivals (`hybridreg.search.hypothesis.Hypothesis`), in that
        order; the verdict need not compute it again. Empty where it knows nothing.
    weighed : object or None
        What the verdict would weigh, where the estimator has done so (`hybridreg.verdict.weighing.Weighed`).
    entries : tuple of EntryTrace
        What each entry did, where the estimator tried several.
    """

    T: Array
    inliers: NDArray[np.bool_] | None = None
    rivals: Array = field(default_factory=lambda: np.zeros((0, 4, 4)))
    found: bool = True
    found_by: int = 1
    hypotheses: tuple[Any, ...] = ()
    weighed: Any = None
    entries: tuple[EntryTrace, ...] = ()

    def is_at(self, T: Array) -> bool:
        """Whether T (4, 4) is this pose but for the rounding of a rotation made exact."""
        return bool(np.allclose(self.T, T, rtol=0.0, atol=_SAME))

    @classmethod
    def ranked(cls, poses: Sequence[Array], inliers: NDArray[np.bool_] | None = None) -> Pose:
        """The first of `poses` (4, 4), at least one, with the others as its rivals; `inliers` are the first one's."""
        return cls(poses[0], inliers, np.array(poses[1:]).reshape(-1, 4, 4))

    @classmethod
    def unknown(cls, n_matches: int = 0) -> Pose:
        """No pose could be found: the identity, marked as such."""
        return cls(np.eye(4), inliers=np.zeros(n_matches, dtype=bool), found=False)
