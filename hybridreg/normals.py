# SPDX-License-Identifier: MIT
"""Normals of a level's points, computed once a run."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.runtime.optional_packages import load
from hybridreg.scene import Level, Scene

Array = NDArray[np.float64]
Side = Literal["source", "target"]

# small_gicp gives no normal to a point with fewer neighbours.
_FEWEST = 5


def of(scene: Scene, side: Side, k: int = 20) -> Array:
    """Normals (n, 3) of one level from each point's k nearest neighbours, shared by the stages of the run."""
    level: Level = getattr(scene, side)
    return scene.shared(("normals", side, k), lambda: estimate(level.points, level.viewpoint, k))


def tree(scene: Scene, side: Side) -> cKDTree:
    """KD-tree of one level, shared by the stages of the run."""
    level: Level = getattr(scene, side)
    return scene.shared(("tree", side), lambda: cKDTree(level.points))


def estimate(points: Array, viewpoint: Array | None, k: int = 20) -> Array:
    """Normals (n, 3) of `points` (n, 3): the direction of least spread among the k nearest neighbours.

    Of unit length, towards the sensor at `viewpoint` (3,), the nearest of several (k, 3), or upwards where its place is
    not known. The wheel of
    small_gicp computes them four times as fast as numpy does.
    """
    small_gicp = load("small_gicp", "every estimate of normals")
    k = min(k, len(points))
    # All neighbours several times over tell the same.
    times = -(-_FEWEST // k)
    cloud = small_gicp.PointCloud(np.tile(points, (times, 1)))
    # One thread (`hybridreg.runtime.threads`): with two, a level of 5,000 points took as long on idle cores, and
    # 2.5 times as long on busy ones.
    tree = small_gicp.KdTree(cloud, num_threads=1)
    small_gicp.estimate_normals(cloud, tree, times * k, 1)
    found: Array = cloud.normals()[: len(points), :3]
    towards = np.array([0.0, 0.0, 1.0]) if viewpoint is None else _nearest(viewpoint, points) - points
    away = np.einsum("ni,ni->n", found, np.broadcast_to(towards, found.shape)) < 0.0
    return np.where(away[:, None], -found, found)


def _nearest(places: Array, points: Array) -> Array:
    return places if places.ndim == 1 else places[cKDTree(places).query(points)[1]]
