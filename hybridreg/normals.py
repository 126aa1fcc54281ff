# SPDX-License-Identifier: MIT
"""Normals of a level's points, computed once a run."""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.resources import n_threads
from hybridreg.scene import Level, Scene

Array = NDArray[np.float64]


class Surface(NamedTuple):
    """Local shape at each point.

    normals : (n, 3) float64, unit length, towards the sensor where its place is known, else upwards
    planarity : (n,) float64 in [0, 1], (l2 - l3) / l1 of the neighbourhood's eigenvalues
    """

    normals: Array
    planarity: Array


def surface(scene: Scene, side: Literal["source", "target"], k: int = 20) -> Surface:
    """Normals of one level from each point's k nearest neighbours, shared by the stages of the run."""
    level: Level = getattr(scene, side)
    return scene.shared(("surface", side, k), lambda: estimate(level.points, level.viewpoint, k))


def tree(scene: Scene, side: Literal["source", "target"]) -> cKDTree:
    """KD-tree of one level, shared by the stages of the run."""
    level: Level = getattr(scene, side)
    return scene.shared(("tree", side), lambda: cKDTree(level.points))


def estimate(points: Array, viewpoint: Array | None, k: int = 20) -> Surface:
    """Normals (n, 3) of `points` (n, 3): the direction of least spread among the k nearest neighbours."""
    k = min(k, len(points))
    _, index = cKDTree(points).query(points, k=k, workers=n_threads())
    neighbours = points.take(index.reshape(len(points), k), axis=0)
    # einsum sums over the middle axis several times faster than mean.
    centred = neighbours - np.einsum("nki->ni", neighbours)[:, None] / k
    values, vectors = np.linalg.eigh(np.swapaxes(centred, 1, 2) @ centred / k)
    normals = vectors[:, :, 0]
    towards = np.array([0.0, 0.0, 1.0]) if viewpoint is None else viewpoint - points
    away = np.sum(normals * towards, axis=1) < 0.0
    normals = np.where(away[:, None], -normals, normals)
    return Surface(normals, (values[:, 1] - values[:, 0]) / np.maximum(values[:, 2], 1e-30))
