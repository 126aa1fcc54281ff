# SPDX-License-Identifier: MIT
"""Is a map bent, so that no pose lays all of it right?

A map that was put together from many scans drifts: it bends, sags, grows too long, or slips. A pose may lie right in
its middle, and metres off at its ends: parts of it lie better elsewhere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import Onto
from hybridreg.evidence.deformation.parts import Part, lying_better
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.geometry.range_image import RangeImage
from hybridreg.resolution import Tolerance, tolerance

Array = NDArray[np.float64]

# Tolerances by which a part of either cloud must lie off: by hand.
_HARM = 0.8


class Bend(NamedTuple):
    """By how many `degrees` and `metres` that part which lies farthest off would lie better."""

    degrees: float
    metres: float


def bend(views: Views, T_target_source: Array) -> Bend | None:
    """The bend about a pose (4, 4); None where there is none, or where each cloud was taken by one sensor from one
    place, whose scan does not bend."""
    if all(isinstance(view.image, RangeImage) for view in (views.source, views.target)):
        return None
    least = _HARM * tolerance(views.scene.pair.source, views.scene.pair.target).metres
    T_source_target = se3.inverse(T_target_source)
    forth = lying_better(Onto.target(views), T_target_source, T_target_source[None], least)
    starts = np.concatenate([T_source_target[None], _reversed(forth)])
    back = lying_better(Onto.source(views), T_source_target, starts, least)
    # Of a long slip one way finds what the other does not reach by itself.
    if back and not forth:
        forth = lying_better(Onto.target(views), T_target_source, _reversed(back), least)
    if not forth or not back:
        return None
    degrees, metres = min((_farthest(parts) for parts in (forth, back)), key=lambda off: off.metres)
    return Bend(degrees, metres)


def _reversed(parts: list[Part]) -> Array:
    return se3.inverse(np.array([part.T for part in parts]).reshape(-1, 4, 4))


def _farthest(parts: list[Part]) -> Tolerance:
    return max((part.off for part in parts), key=lambda off: off.metres)
