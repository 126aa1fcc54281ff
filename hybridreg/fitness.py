# SPDX-License-Identifier: MIT
"""How much of one cloud lies on the other: Open3D's measures, computed with scipy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg import se3

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Fitness:
    """Agreement of a moved source with a target.

    Attributes
    ----------
    fitness : share of the source's points with a target point within the distance
    inlier_rmse : root mean square distance of those, metres; 0 where there are none
    correspondence_set : (K, 2) int64, rows of source and target
    """

    fitness: float
    inlier_rmse: float
    correspondence_set: NDArray[np.int64]


def measure(source: Array, target: cKDTree | Array, T: Array, max_distance: float) -> Fitness:
    """Fitness of `source` (N, 3) moved by T onto `target` (M, 3), as Open3D's `evaluate_registration`.

    Parameters
    ----------
    target : array, or the KD-tree of one where it is used again
    max_distance : float
        Metres; a neighbour must be nearer than this.
    """
    tree = target if isinstance(target, cKDTree) else cKDTree(target)
    distance, index = tree.query(se3.apply(T, source), distance_upper_bound=max_distance, workers=-1)
    hit = np.isfinite(distance)
    rows = np.flatnonzero(hit)
    rmse = float(np.sqrt(np.mean(distance[hit] ** 2))) if len(rows) else 0.0
    return Fitness(len(rows) / len(source), rmse, np.column_stack([rows, index[hit]]).astype(np.int64))
