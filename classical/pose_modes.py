# SPDX-License-Identifier: MIT
"""The best pose, and the poses far from it that the matches support nearly as well."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.consensus import Consensus, Support, distances

Array = NDArray[np.float64]

# Poses closer than both are one mode.
_SAME_DEG = 5.0  # degrees, by hand
# Distances at which matches agree (2 to 3 m for vehicle LiDAR, decimetres in a room); by hand.
_SAME_DISTANCES = 4.0
_MOST_MODES = 8


def modes(
    consensus: Consensus, poses: Array, counts: NDArray[np.int64], *, refit: bool, share: float
) -> list[Support]:
    """Distinct poses, best first, each refitted: non-maximum suppression over hypotheses.

    Parameters
    ----------
    poses, counts : (B, 4, 4), (B,)
        Hypotheses, and the number of matches that agree with each.
    share : float in [0, 1]
        A pose needs this share of the best one's support to be returned.
    """
    centre = np.median(consensus.source, axis=0)
    found: list[Support] = []
    left = np.argsort(-counts, kind="stable")
    least = 1.0
    while len(left) and len(found) < _MOST_MODES and counts[left[0]] >= least:
        seed = consensus.support(poses[left[0]])
        found.append(consensus.refit(seed) if refit else seed)
        near = same(poses[left], seed.T, centre, consensus) | same(
            poses[left], found[-1].T, centre, consensus
        )
        near[0] = True
        left = left[~near]
        # Refitting at most about doubles a hypothesis's support, so half the share is required before it.
        least = max(least, 0.5 * share * found[-1].n_inliers)
    found.sort(key=lambda one: -one.score)
    return _distinct([one for one in found if one.score >= share * found[0].score], centre, consensus)


def _distinct(found: list[Support], centre: Array, consensus: Consensus) -> list[Support]:
    # Two hypotheses far apart may have been refitted to one pose.
    kept: list[Support] = []
    for one in found:
        if not any(same(one.T[None], other.T, centre, consensus)[0] for other in kept):
            kept.append(one)
    return kept


def same(poses: Array, T: Array, centre: Array, consensus: Consensus) -> NDArray[np.bool_]:
    """Which of the poses (B, 4, 4) belong to one mode with T (4, 4), compared at `centre` (3,)."""
    degrees, metres = distances(poses, T, centre)
    return (degrees < _SAME_DEG) & (metres < _SAME_DISTANCES * consensus.max_distance)
