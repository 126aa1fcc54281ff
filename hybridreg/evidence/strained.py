# SPDX-License-Identifier: MIT
"""A pose that may also strain the source, scale or stretch it, so that it lies on the target as closely as it can."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.surface_distance import Surfaces
from hybridreg.evidence.views import Views
from hybridreg.geometry.point_to_plane import descend

Array = NDArray[np.float64]

# Farthest partners of the rough steps, spacings; by hand.
_ROUGHLY = (8.0, 5.0, 4.0, 3.0, 2.0, 2.0)
# Farthest partners of the fine steps, shares of the fine surfaces' own; by hand.
_CLOSELY = (1.0, 0.6, 0.4)
# Points that take part; by hand.
POINTS = 700
# Width of the weights per farthest partner; by hand.
_TRUST = 0.25


def strained(views: Views, T_target_source: Array, strains: Array) -> Array:
    """The affine map (4, 4) near a pose that fits best: the pose moves and strains the source.

    Parameters
    ----------
    strains : (k, 3, 3)
        As `hybridreg.geometry.point_to_plane.descend` takes them.
    """
    spacing = views.spacing
    some = views.source.points[views.source.settling[:POINTS]]
    roughly = [_step(reach * spacing, spacing) for reach in _ROUGHLY]
    A = descend(T_target_source, some, views.target, roughly, strains)
    fine, surfaces = views.fine
    return descend(A, fine.asked[:POINTS], surfaces, close_steps(surfaces), strains)


def close_steps(surfaces: Surfaces) -> list[tuple[float, float]]:
    """Steps of `descend` on the fine surfaces, from rough to close."""
    return [_step(part * surfaces.far, surfaces.noise) for part in _CLOSELY]


def _step(reach: float, noise: float) -> tuple[float, float]:
    return reach, max(noise, _TRUST * reach)
