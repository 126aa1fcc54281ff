# SPDX-License-Identifier: MIT
"""A pair after downsampling, with what the stages of one run share."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.matches import Correspondences
from hybridreg.pair import Pair

Array = NDArray[np.float64]
Value = TypeVar("Value")


@dataclass(frozen=True, eq=False, kw_only=True)
class Level:
    """One downsampled cloud.

    Attributes
    ----------
    points : (n, 3) float64
        In the frame of the pair's cloud (its offset taken off), metres.
    spacing : float
        Typical distance of neighbours, metres: the voxel where a grid made the level.
    viewpoint : (3,), (k, 3) of several places, or None
        Where the sensor stood.
    """

    points: Array
    spacing: float
    viewpoint: Array | None = None

    def __len__(self) -> int:
        return len(self.points)


def centre(level: Level) -> Array:
    """Where the cloud was seen from, (3,): the middle of several places; of the points where none is known."""
    if level.viewpoint is None:
        middle: Array = np.median(level.points, axis=0)
        return middle
    return level.viewpoint if level.viewpoint.ndim == 1 else level.viewpoint.mean(axis=0)


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """What downsampling gives, and every later stage receives.

    Attributes
    ----------
    pair : Pair
    source, target : Level
    notes : list of str
        What a stage wants the user to read in the result: a default it chose, a cap that bit.
    explanations : list of str
        Mistakes of the user's under which the clouds would fit: what the verdict's reasons begin with.
    matches : list of Correspondences
        What the run's matchers found so far, each with one match at least.
    """

    pair: Pair
    source: Level
    target: Level
    notes: list[str] = field(default_factory=list)
    explanations: list[str] = field(default_factory=list)
    matches: list[Correspondences] = field(default_factory=list)
    _shared: dict[Hashable, Any] = field(default_factory=dict, repr=False)

    @property
    def spacing(self) -> float:
        """The coarser of the two levels' spacings, metres: the resolution at which the clouds can be compared."""
        return max(self.source.spacing, self.target.spacing)

    def shared(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Return `make()`, computed once a run for each key (normals, features, a network's encoding)."""
        if key not in self._shared:
            self._shared[key] = make()
        value: Value = self._shared[key]
        return value

    def matched(self, found: Correspondences) -> Correspondences:
        """Remember what a matcher found, as evidence for or against every pose."""
        if len(found):
            self.matches.append(found)
        return found

    def note(self, text: str) -> None:
        """Leave a sentence for the result, once."""
        if text not in self.notes:
            self.notes.append(text)
