# SPDX-License-Identifier: MIT
"""What the run's matchers say about a pose: surfaces that look alike should lie on one another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.matches import Correspondences
from hybridreg.scene import Scene

Array = NDArray[np.float64]

# Spacings within which a match agrees with a pose.
_NEAR = 2.0


def agreeing(scene: Scene, matches: Correspondences, T: Array) -> int:
    """How many matches the pose (4, 4) brings within two spacings of one another."""
    gap = np.linalg.norm(se3.apply(T, matches.source) - matches.target, axis=1)
    return int(np.count_nonzero(gap < _NEAR * (matches.spacing or scene.spacing)))


def share(scene: Scene, T: Array) -> float:
    """Agreeing share of the matches of that matcher of which most agree; 0 where none ran."""
    return max((_share_of(scene, found, T) for found in scene.matches), default=0.0)


def of_most(scene: Scene, T: Array) -> Correspondences:
    """Those matches of the run of which the largest share agrees with the pose; none where no matcher ran."""
    if not scene.matches:
        return Correspondences.none()
    return max(scene.matches, key=lambda found: _share_of(scene, found, T))


def _share_of(scene: Scene, found: Correspondences, T: Array) -> float:
    return agreeing(scene, found, T) / len(found)
