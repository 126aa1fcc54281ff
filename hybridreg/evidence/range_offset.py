# SPDX-License-Identifier: MIT
"""Ranges that are all off by as much. Nearby, that looks like another size."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.strained import POINTS, close_steps
from hybridreg.evidence.surface_distance import one_way
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.geometry.point_to_plane import descend

Array = NDArray[np.float64]

# What a sensor's ranges may be off by, metres: of a real pair that was cropped to 5, 8, 12 and 20 m, the source seemed
# 4.8, 2.9, 1.8 and 1.1 % too small. By hand.
_OFFSETS = (-0.2, -0.15, -0.1, -0.05, 0.05, 0.1, 0.15, 0.2)
# Strains that move half of the points farther than this have another cause, metres; by hand.
_MOST = 0.4


def explains(views: Views, T_target_source: Array, strained: Array) -> bool:
    """Whether an offset of all the source's ranges lets its points lie as closely about a pose (4, 4) as the affine map
    `strained` (4, 4) does: then nothing is strained."""
    source, target = views.fine
    A = strained[:3, :3]
    moved = (source.asked - views.middle) @ (A - se3.project(A)).T
    if views.source.image is None or np.median(np.linalg.norm(moved, axis=1)) > _MOST:
        return False
    rays = source.asked - views.source.centre
    ranges = np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), target.far)

    def closely(offset: float) -> float:
        shifted = source.asked + offset * rays / ranges
        return one_way(
            shifted, target, descend(T_target_source, shifted[:POINTS], target, close_steps(target))
        )

    return max(map(closely, _OFFSETS)) >= one_way(source.asked, target, strained)
