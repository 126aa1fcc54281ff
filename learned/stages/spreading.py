# SPDX-License-Identifier: MIT
"""Overlap probabilities from superpoints to the points of a level, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]


def spread(probability: Array, nodes: Array, points: Array) -> Array:
    """Each point (n, 3) takes the probability (k,) of its nearest superpoint (k, 3): a patch's own rule."""
    return probability[_nearest(points, nodes)]


def gather(probability: Array, points: Array, nodes: Array) -> Array:
    """Each superpoint (k, 3) takes the mean probability of the points (n, 3) that are nearest to it.

    The inverse of `spread`: a spread mask is recovered exactly. A superpoint that is nearest to no point takes the
    value of its nearest point.
    """
    owner = _nearest(points, nodes)
    count = np.bincount(owner, minlength=len(nodes))
    mean = np.bincount(owner, weights=probability, minlength=len(nodes)) / np.maximum(count, 1)
    bare = count == 0
    mean[bare] = probability[_nearest(nodes[bare], points)]
    return mean


def _nearest(queries: Array, of: Array) -> NDArray[np.int64]:
    return np.asarray(cKDTree(of).query(queries)[1], dtype=np.int64)
