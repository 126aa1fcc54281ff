# SPDX-License-Identifier: MIT
"""RANSAC-50K as the learned methods' papers report it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.geometry.kabsch import STATUSES, kabsch_batch
from hybridreg.matches import Correspondences, Pose
from hybridreg.runtime.threads import single
from hybridreg.scene import Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# Samples fitted together, and poses whose matches are counted together: the fastest of 500, 5,000 and 50,000.
_BATCH = 5_000
_SIZE = 4


@dataclass(frozen=True, kw_only=True)
class Ransac50k(Stage):
    """50,000 samples of four matches, none refused, none refitted, never stopped early; the best pose is the result.

    What GeoTransformer, CoFiNet and Predator call RANSAC-50K on KITTI: Open3D's `ransac_n=4`, 50,000 iterations and no
    checkers (GeoTransformer, `modules/registration/ransac`), here seeded, as Open3D's own does not repeat. `ransac`
    is this library's: it refuses samples that are not rigid, stops when it is sure, and refits.

    Parameters
    ----------
    max_distance : float
        Metres; a match agrees with a pose when its residual is smaller. 0.3 as published, where the voxel is 0.3 m.
    iterations : int
        Samples drawn, all with the same chance.
    """

    max_distance: float = 0.3
    iterations: int = 50_000

    needs: ClassVar[frozenset[str]] = frozenset({"matches"})

    def __post_init__(self) -> None:
        if not self.max_distance > 0.0:
            raise ValueError(f"max_distance={self.max_distance} must be a positive length in metres")
        if self.iterations < 1:
            raise ValueError(f"iterations={self.iterations} must be at least 1")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        finite = np.isfinite(matches.source).all(axis=1) & np.isfinite(matches.target).all(axis=1)
        source, target = matches.source[finite], matches.target[finite]
        if len(source) < _SIZE:
            return Pose.unknown(len(matches))
        best, T = (0, 0.0), np.eye(4)
        with single():
            for start in range(0, self.iterations, _BATCH):
                rows = rng.integers(0, len(source), (min(_BATCH, self.iterations - start), _SIZE))
                fits = kabsch_batch(source[rows], target[rows])
                poses = fits.T[fits.status == STATUSES.index("ok")]
                for block in np.array_split(poses, max(1, len(poses) * len(source) // 2**22 + 1)):
                    best, T = self._better(best, T, block, source, target)
        if best[0] < 3:
            return Pose.unknown(len(matches))
        inliers = np.linalg.norm(se3.apply(T, matches.source) - matches.target, axis=1) < self.max_distance
        return Pose(T, inliers=inliers)

    def _better(
        self, best: tuple[int, float], T: Array, poses: Array, source: Array, target: Array
    ) -> tuple[tuple[int, float], Array]:
        # Open3D's order: more inliers, and among as many the smaller error.
        if not len(poses):
            return best, T
        moved = np.einsum("bij,kj->bki", poses[:, :3, :3], source, optimize=True) + poses[:, None, :3, 3]
        squared = np.square(moved - target).sum(axis=2)
        agree = squared < self.max_distance**2
        counts = agree.sum(axis=1)
        errors = np.where(agree, squared, 0.0).sum(axis=1) / np.maximum(counts, 1)
        first = int(np.lexsort((errors, -counts))[0])
        found = (int(counts[first]), -float(errors[first]))
        return (found, poses[first]) if found > best else (best, T)
