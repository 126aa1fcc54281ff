# SPDX-License-Identifier: MIT
"""From several starts to one pose: guided matching from each, and what all similar points support most goes on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.extent import sample
from hybridreg.learned.matching.guided_matching import guided_pose
from hybridreg.learned.matching.similar_points import similar_points
from hybridreg.learned.matching.upright_votes import upright_poses
from hybridreg.matches import Described

Array = NDArray[np.float64]

# Points of each cloud that tell the starts apart. With 1,500 poses were lost on `sim:val/far`, with all it takes thrice
# as long and finds as many.
_POINTS = 2500
# Upright poses beside the given start; with five as many were right.
_UPRIGHT = 3
# Spacings of the points: of each start, and of the one that goes on. More rounds for all starts made no difference.
_COARSE = np.array([4.0, 2.5, 1.6, 1.0])
_FINE = np.array([1.6, 1.3, 1.0, 1.0, 1.0])


def search(starts: Sequence[Array], source: Described, target: Described, spacing: float) -> Array | None:
    """The pose (4, 4), or None where no similar points support any.

    Parameters
    ----------
    starts : of (4, 4)
        Poses from elsewhere. Those that upright clouds vote for are added (`upright_votes`).
    source, target : Described
    spacing : float
        Typical distance of the points, metres.
    """
    if not len(source.points) or not len(target.points):
        return None
    few = _some(source), _some(target)
    pairs = similar_points(*few)
    tried = [*starts, *upright_poses(pairs, spacing, _UPRIGHT)]
    near = [guided_pose(T, *few, spacing * _COARSE) for T in tried]
    support = [pairs.support(T, spacing) for T in near]
    best = int(np.argmax(support))
    return guided_pose(near[best], source, target, spacing * _FINE) if support[best] > 0.0 else None


def _some(cloud: Described) -> Described:
    rows = sample(np.arange(len(cloud.points)), _POINTS)
    return Described(cloud.points[rows], cloud.features[rows])
