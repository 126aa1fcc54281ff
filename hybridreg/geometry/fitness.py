# SPDX-License-Identifier: MIT
"""How much of one cloud lies on the other: Open3D's measures, computed with scipy."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.geometry import se3
from hybridreg.geometry.extent import bounds
from hybridreg.runtime.cores import n_threads
from hybridreg.runtime.side_by_side import side_by_side

Array = NDArray[np.float64]

# Number of queries from which their order matters: a large tree does not fit the processor's cache, and queries near
# each other read the same part of it. Half a million in random order took three times as long.
_MANY = 300_000
_MOST_CELLS = 2**20  # cells along an axis, so that a cell's three indices fit into one key


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


@dataclass(frozen=True, eq=False)
class Overlay:
    """Two whole clouds in one frame, (N, 3) and (M, 3), with a distance in metres.

    Measures on every point take as long as the search of a quick registration, so they are computed on first access.
    """

    source: Array = field(repr=False)
    target: Array = field(repr=False)
    T_target_source: Array = field(repr=False)
    max_distance: float

    @cached_property
    def _both_ways(self) -> tuple[Fitness, Fitness]:
        T = self.T_target_source
        ways = (self.source, self.target, T), (self.target, self.source, se3.inverse(T))
        # As a tree is built by one thread.
        forth, back = side_by_side(lambda way: measure(*way, self.max_distance), *ways)
        return forth, back

    @property
    def of_source(self) -> Fitness:
        """Fitness of the source on the target."""
        return self._both_ways[0]

    @property
    def of_target(self) -> Fitness:
        """Fitness of the target on the source."""
        return self._both_ways[1]


def measure(source: Array, target: cKDTree | Array, T: Array, max_distance: float) -> Fitness:
    """Fitness of `source` (N, 3) moved by T onto `target` (M, 3), as Open3D's `evaluate_registration`.

    Parameters
    ----------
    target : array, or the KD-tree of one where it is used again
    max_distance : float
        Metres; a neighbour must be nearer than this.
    """
    tree = target if isinstance(target, cKDTree) else cKDTree(target, leafsize=32, balanced_tree=False)
    distance, index = _nearest(tree, se3.apply(T, source), max_distance)
    hit = np.isfinite(distance)
    rows = np.flatnonzero(hit)
    rmse = float(np.sqrt(np.mean(distance[hit] ** 2))) if len(rows) else 0.0
    return Fitness(len(rows) / len(source), rmse, np.column_stack([rows, index[hit]]).astype(np.int64))


def _nearest(tree: cKDTree, points: Array, max_distance: float) -> tuple[Array, NDArray[np.int64]]:
    if len(points) < _MANY:
        found: tuple[Array, NDArray[np.int64]] = tree.query(
            points, distance_upper_bound=max_distance, workers=n_threads()
        )
        return found
    order = _by_place(points, max_distance)
    distance, index = np.empty(len(points)), np.empty(len(points), dtype=np.int64)
    distance[order], index[order] = tree.query(
        points[order], distance_upper_bound=max_distance, workers=n_threads()
    )
    return distance, index


def _by_place(points: Array, cell: float) -> NDArray[np.int64]:
    """An order of points (n, 3) that keeps points of one grid cell together."""
    low, high = bounds(points)
    cell = max(cell, float((high - low).max()) / _MOST_CELLS)
    x, y, z = np.minimum((points - low) / cell, _MOST_CELLS - 1).astype(np.int64).T
    order: NDArray[np.int64] = np.argsort((x * _MOST_CELLS + y) * _MOST_CELLS + z)
    return order
