# SPDX-License-Identifier: MIT
"""Guided matching: once a pose is known, every point has few candidates left (Hartley and Zisserman, algorithm 4.6)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.geometry import se3
from hybridreg.geometry.kabsch import kabsch
from hybridreg.matches import Described

Array = NDArray[np.float64]

# Nearest candidates whose features are compared: all within the last radius, for speed; by hand.
_CANDIDATES = 16
# Of the softmax over the candidates' cosines; as in the votes for superpoint pairs (docs/methods.md 7.3).
_TEMPERATURE = 0.05
# Power of the cosine in a match's weight; 8 and 16 on `sim:val`, 200 pairs, as good.
_SHARPNESS = 4
# Fewest matches that move the pose; by hand.
_FEWEST = 10


def guided_pose(T_target_source: Array, source: Described, target: Described, radii: Array) -> Array:
    """The pose (4, 4) after a round for each radius: match within it, fit.

    Each point of either cloud is matched with the most similar of its nearest points in the other. A match weighs
    more the more similar its features are, the less similar the other candidates', and the nearer it is (Tukey's
    biweight). A round with fewer than ten matches ends the search.

    Parameters
    ----------
    T_target_source : (4, 4)
        From which to start.
    source, target : Described
    radii : (r,)
        Metres, shrinking: the first is what the start may be off by.
    """
    T = T_target_source
    if not len(source.points) or not len(target.points):
        return T
    trees = cKDTree(source.points), cKDTree(target.points)
    for radius in radii:
        moved, moved_back = se3.apply(T, source.points), se3.apply(se3.inverse(T), target.points)
        there, weight_there = _matched(moved, source.features, trees[1], target.features, radius)
        back, weight_back = _matched(moved_back, target.features, trees[0], source.features, radius)
        if np.count_nonzero(weight_there) + np.count_nonzero(weight_back) < _FEWEST:
            break
        fitted, status = kabsch(
            np.concatenate([source.points, source.points[back]]),
            np.concatenate([target.points[there], target.points]),
            np.concatenate([weight_there, weight_back]),
        )
        if status != "ok":
            break
        T = fitted
    return T


def _matched(
    points: Array, features: NDArray[np.float32], tree: cKDTree, others: NDArray[np.float32], radius: float
) -> tuple[NDArray[np.int64], Array]:
    # The row of each point's match, and its weight: zero where no other point is within the radius, as beyond the
    # overlap.
    distance, near = tree.query(
        points, k=[*range(1, min(_CANDIDATES, tree.n) + 1)], distance_upper_bound=radius
    )
    some = np.flatnonzero(near[:, 0] < tree.n)
    distance, near = distance[some], near[some]
    within = near < tree.n
    near = np.where(within, near, 0)
    cosine = np.where(within, (others[near] @ features[some][:, :, None])[:, :, 0], -1.0).astype(np.float64)
    best = cosine.argmax(axis=1)
    row = np.arange(len(some))
    highest = cosine[row, best]
    among = (np.exp((cosine - highest[:, None]) / _TEMPERATURE) * within).sum(axis=1)
    closeness = np.maximum(1.0 - (distance[row, best] / radius) ** 2, 0.0) ** 2
    match, weight = np.zeros(len(points), dtype=np.int64), np.zeros(len(points))
    match[some] = near[row, best]
    weight[some] = np.maximum(highest, 0.0) ** _SHARPNESS * closeness / np.maximum(among, 1.0)
    return match, weight
