# SPDX-License-Identifier: MIT
"""How many of the run's feature matches agree with a pose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.matches import Correspondences
from hybridreg.scene import Scene

Array = NDArray[np.float64]

# Spacings within which a match agrees with a pose; by hand.
_NEAR = 2.0


def agreeing(scene: Scene, matches: Correspondences, T: Array) -> int:
    """How many matches the pose (4, 4) brings within two spacings of one another."""
    gap = np.linalg.norm(se3.apply(T, matches.source) - matches.target, axis=1)
    return int(np.count_nonzero(gap < _NEAR * (matches.spacing or scene.spacing)))


def share(scene: Scene, T: Array) -> float:
    """Largest agreeing share of any matcher's matches; 0 where none ran."""
    return max((_share_of(scene, found, T) for found in scene.matches), default=0.0)


def of_most(scene: Scene, T: Array) -> Correspondences:
    """The matches of the matcher with the largest agreeing share; none where no matcher ran."""
    if not scene.matches:
        return Correspondences.none()
    return max(scene.matches, key=lambda found: _share_of(scene, found, T))


def _share_of(scene: Scene, found: Correspondences, T: Array) -> float:
    return agreeing(scene, found, T) / len(found)
