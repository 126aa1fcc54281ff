# SPDX-License-Identifier: MIT
"""One pair of clouds with every pose that is right, and how far from right another pose is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.pair import LabelledPair

Array = NDArray[np.float64]
# Degrees within which a pose is right.
DEGREES = 2.0
# Metres within which one of vehicles' sensors is.
_METRES = 0.5


@dataclass(frozen=True, eq=False, kw_only=True)
class Sample:
    """Two clouds (N, 3) as a user would give them, and their right poses."""

    kind: str
    name: str
    source: Array
    target: Array
    # Every T_target_source (4, 4) that is right; empty where no pose is.
    truths: tuple[Array, ...]
    # Within this many metres, and 2 degrees, a pose is right.
    metres: float
    # Whether a good method should find it: enough common surface that faces three ways, and no repetition.
    solvable: bool
    # The mistake that the input contains: "mirror", "scale 0.95" (multiply the source), "mm", "cm" or "ft".
    cure: str = ""

    @classmethod
    def of(cls, labelled: LabelledPair, kind: str, *, hopeless: bool) -> Sample:
        """A data set's pair, right within half a metre; no pose is where its clouds show different places."""
        pair = labelled.pair
        return cls(
            kind=kind,
            name=pair.id,
            source=pair.source.points + pair.source.offset,
            target=pair.target.points + pair.target.offset,
            truths=() if hopeless else (labelled.T_target_source,),
            metres=_METRES,
            solvable=not hopeless,
        )


Maker = Callable[[np.random.Generator, int], Sample]


def error(sample: Sample, T: Array) -> tuple[float, float]:
    """Degrees and metres between T (4, 4) and the nearest right pose; both infinite where no pose is right.

    Metres are those by which the median point of the source moves: in a frame with a far origin the difference of
    the translations says more about the rotation than about the position.
    """
    middle = np.median(sample.source, axis=0)[None]
    off = [
        (
            se3.angle_deg(truth[:3, :3].T @ T[:3, :3]),
            float(np.linalg.norm(se3.apply(T, middle) - se3.apply(truth, middle))),
        )
        for truth in sample.truths
    ]
    if not off:
        return np.inf, np.inf
    return min(off, key=lambda one: max(one[0] / DEGREES, one[1] / sample.metres))


def is_right(sample: Sample, T: Array) -> bool:
    """Whether T (4, 4) lies within the tolerance of a right pose."""
    degrees, metres = error(sample, T)
    return degrees < DEGREES and metres < sample.metres
