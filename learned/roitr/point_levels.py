# SPDX-License-Identifier: MIT
"""The levels of one cloud: farthest points, their neighbours, and the links between levels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from torch import Tensor

from hybridreg.learned.roitr.config import RoitrConfig

Points = NDArray[np.float32]
Rows = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Levels:
    """One cloud at every level, the finest first. Level l has N_l points; indices are int64.

    Built on the CPU whatever the device: farthest points are chosen one after another, and equal choices on every
    device are worth more than the milliseconds.
    """

    points: tuple[Tensor, ...]  # (N_l, 3) float32, metres
    normals: tuple[Tensor, ...]  # (N_l, 3) float32, unit length
    neighbors: tuple[Tensor, ...]  # (N_l, k_l) within the level, nearest first, without the point itself
    picked: tuple[Tensor, ...]  # (N_l,) into level l - 1, for l > 0
    down: tuple[Tensor, ...]  # (N_l, k_l) into level l - 1, for l > 0, without the point itself
    up: tuple[Tensor, ...]  # (N_l, 3) into level l + 1, but for the last level
    up_distance: tuple[Tensor, ...]  # (N_l, 3) metres

    def to(self, device: torch.device | str) -> Levels:
        """The same on another device."""
        names = ("points", "normals", "neighbors", "picked", "down", "up", "up_distance")
        return Levels(**{name: tuple(t.to(device) for t in getattr(self, name)) for name in names})


def build_levels(points: Points, normals: Points, config: RoitrConfig) -> Levels:
    """Levels of a cloud (N, 3) with its normals (N, 3): each keeps a share of the points, selected, never averaged."""
    clouds, directions = [points], [normals]
    picked, down = [], []
    trees = [cKDTree(points)]
    for stride, k in zip(config.strides[1:], config.neighbors[1:], strict=True):
        finer = clouds[-1]
        rows = farthest_points(finer, max(1, len(finer) // stride)) if stride > 1 else np.arange(len(finer))
        picked.append(rows)
        down.append(nearest_others(trees[-1], rows, k))
        clouds.append(finer[rows])
        directions.append(directions[-1][rows])
        trees.append(cKDTree(clouds[-1]))
    within = [
        nearest_others(tree, np.arange(tree.n), k) for tree, k in zip(trees, config.neighbors, strict=True)
    ]
    found = [
        _nearest(coarser, finer, config.interpolation)
        for finer, coarser in zip(clouds[:-1], trees[1:], strict=True)
    ]
    return Levels(
        points=_tensors(clouds),
        normals=_tensors(directions),
        neighbors=_tensors(within),
        picked=_tensors(picked),
        down=_tensors(down),
        up=_tensors([rows for _, rows in found]),
        up_distance=_tensors([distance.astype(np.float32) for distance, _ in found]),
    )


def farthest_points(points: Points, count: int) -> Rows:
    """``count`` rows of (N, 3), each the farthest from those before it; row 0 first, ties to the first."""
    columns = np.ascontiguousarray(points.T)  # (3, N)
    rows = np.zeros(count, dtype=np.int64)
    best = np.full(len(points), np.inf, dtype=np.float32)
    for k in range(1, count):
        apart = columns - columns[:, rows[k - 1], None]
        apart *= apart
        np.minimum(best, apart[0] + apart[1] + apart[2], out=best)
        rows[k] = best.argmax()
    return rows


def nearest_others(tree: cKDTree, rows: Rows, k: int) -> Rows:
    """The k nearest other points (n, k) of a tree's own points ``rows`` (n,); fewer columns where it has fewer.

    The original drops the nearest result, which is a duplicate where a point occurs twice; here it is the point
    itself. A single point is its own neighbour.
    """
    wanted = min(k, tree.n - 1)
    if wanted == 0:
        return rows[:, None].copy()
    found = _nearest(tree, tree.data[rows], wanted + 1)[1]
    other = found != rows[:, None]
    other[other.all(axis=1), -1] = False  # more duplicates than requested: the point itself is not among them
    return found[other].reshape(len(rows), wanted)


def _nearest(tree: cKDTree, queries: NDArray[np.floating], k: int) -> tuple[NDArray[np.float64], Rows]:
    k = min(k, tree.n)
    distance, rows = tree.query(queries, k=k)
    shape = (len(queries), k)
    return np.asarray(distance).reshape(shape), np.asarray(rows, dtype=np.int64).reshape(shape)


def _tensors(arrays: Sequence[NDArray[Any]]) -> tuple[Tensor, ...]:
    return tuple(torch.from_numpy(np.ascontiguousarray(array)) for array in arrays)
