# SPDX-License-Identifier: MIT
"""Downsampling without a grid: a random subset, or every point."""

from __future__ import annotations

import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.cloud import PointCloud
from hybridreg.config import limits
from hybridreg.gate import MIN_POINTS
from hybridreg.pair import Pair
from hybridreg.runtime.cores import n_threads
from hybridreg.scene import Level, Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class RandomSample(Stage):
    """Keep `n_points` of each cloud, drawn without replacement.

    Parameters
    ----------
    n_points : int
        Clouds with fewer points are kept whole.
    seed : int
        With the pair's id it fixes the sample.
    """

    n_points: int = 10_000
    seed: int = 0

    def __post_init__(self) -> None:
        super().__post_init__()
        limits.at_least(self, MIN_POINTS, "n_points")
        limits.at_least(self, 0, "seed")

    def __call__(self, pair: Pair) -> Scene:
        rng = np.random.default_rng([self.seed, zlib.crc32(pair.id.encode())])
        return _scene(pair, self._draw(pair.source.points, rng), self._draw(pair.target.points, rng))

    def _draw(self, points: Array, rng: np.random.Generator) -> Array:
        if len(points) <= self.n_points:
            return points
        return points[np.sort(rng.choice(len(points), self.n_points, replace=False))]


@dataclass(frozen=True, kw_only=True)
class AllPoints(Stage):
    """Work on the clouds as they are."""

    def __call__(self, pair: Pair) -> Scene:
        return _scene(pair, pair.source.points, pair.target.points)


def _scene(pair: Pair, source: Array, target: Array) -> Scene:
    return Scene(pair=pair, source=_level(pair.source, source), target=_level(pair.target, target))


def _level(cloud: PointCloud, points: Array) -> Level:
    # The 90th percentile, because a LiDAR's neighbours along one ring are far nearer than its rings.
    distance, _ = cKDTree(points).query(points, k=2, workers=n_threads())
    nonzero = distance[:, 1][distance[:, 1] > 0.0]
    spacing = float(np.quantile(nonzero, 0.9)) if len(nonzero) else 1e-3
    return Level(points=points, spacing=spacing, viewpoint=cloud.viewpoint)
