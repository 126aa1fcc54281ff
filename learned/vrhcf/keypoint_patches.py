# SPDX-License-Identifier: MIT
"""Patches around keypoints: the points within a radius, sampled or repeated to a fixed number."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float32]
Rows = NDArray[np.int64]


def build_patches(
    points: Array, keypoints: Rows, radius: float, count: int, rng: np.random.Generator
) -> Array:
    """Patches (n, count, 3) of rows ``keypoints`` (n,) among points (N, 3).

    Where a patch has more points than wanted, a random subset; where it has fewer, all of them repeated, and a random
    remainder (as ThreeDMatch/Test/preparation.py does, without a seed). The last row is the keypoint itself.
    """
    tree = cKDTree(points)
    near = tree.query_ball_point(points[keypoints], r=radius)
    patches = np.empty((len(keypoints), count, 3), dtype=np.float32)
    for patch, row, around in zip(patches, keypoints, near, strict=True):
        # Sorted: the order of the tree's result is arbitrary, and must not affect the sample.
        patch[:] = points[_to_count(np.sort(np.asarray(around, dtype=np.int64)), count, rng)]
        patch[-1] = points[row]
    return patches


def _to_count(rows: Rows, count: int, rng: np.random.Generator) -> Rows:
    rounds, rest = divmod(count, len(rows))
    drawn = rng.choice(rows, rest, replace=False)
    return np.concatenate([np.tile(rows, rounds), drawn])
