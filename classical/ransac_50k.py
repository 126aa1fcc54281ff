# SPDX-License-Identifier: MIT
"""RANSAC-50K as the learned methods' papers report it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.geometry.consensus import Consensus
from hybridreg.geometry.kabsch import STATUSES, kabsch_batch
from hybridreg.matches import Correspondences, Pose
from hybridreg.runtime.threads import single
from hybridreg.scene import Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]

# Samples fitted together: the fastest of 500, 5,000 and 50,000.
_BATCH = 5_000
_SIZE = 4
# Matches by which a count in single precision may be off: poses this near the best are counted again in double.
_ROUNDING = 1


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
        super().__post_init__()
        if not self.max_distance > 0.0:
            raise ValueError(f"max_distance={self.max_distance} must be a positive length in metres")
        if self.iterations < 1:
            raise ValueError(f"iterations={self.iterations} must be at least 1")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        finite = np.isfinite(matches.source).all(axis=1) & np.isfinite(matches.target).all(axis=1)
        source, target = matches.source[finite], matches.target[finite]
        if len(source) < _SIZE:
            return Pose.unknown(len(matches))
        with single():
            consensus = Consensus(source, target, np.ones(len(source)), self.max_distance)
            supports = [consensus.support(T) for T in self._likeliest(consensus, rng)]
        # Open3D's order: more inliers, and among as many the smaller error; of equals the first.
        best = max(supports, key=lambda one: (one.n_inliers, one.score), default=None)
        if best is None or best.n_inliers < 3:
            return Pose.unknown(len(matches))
        inliers = (
            np.linalg.norm(se3.apply(best.T, matches.source) - matches.target, axis=1) < self.max_distance
        )
        return Pose(best.T, inliers=inliers)

    def _likeliest(self, consensus: Consensus, rng: np.random.Generator) -> Array:
        """Poses of samples (B, 4, 4): those that may be the best."""
        poses, counts = np.empty((0, 4, 4)), np.empty(0, dtype=np.int64)
        for start in range(0, self.iterations, _BATCH):
            rows = rng.integers(0, len(consensus), (min(_BATCH, self.iterations - start), _SIZE))
            fits = kabsch_batch(consensus.source[rows], consensus.target[rows])
            new = fits.T[fits.status == STATUSES.index("ok")]
            poses = np.concatenate([poses, new])
            counts = np.concatenate([counts, consensus.counts(new)])
            hopeful = counts >= counts.max(initial=0) - _ROUNDING
            poses, counts = poses[hopeful], counts[hopeful]
        return poses
