# SPDX-License-Identifier: MIT
"""RANSAC over matches: seeded, vectorised over hypotheses, the same bits for any number of threads."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical import hypotheses
from hybridreg.classical.pose_modes import modes
from hybridreg.geometry import se3
from hybridreg.geometry.consensus import Consensus
from hybridreg.geometry.kabsch import kabsch
from hybridreg.matches import Correspondences, Pose
from hybridreg.runtime.threads import single
from hybridreg.scene import Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]

# Samples drawn together: enough to hide numpy's cost per call, few enough to stop early.
_BATCH = 5_000


@dataclass(frozen=True, kw_only=True)
class Ransac(Stage):
    """The pose that most matches agree with (Fischler and Bolles 1981), with local optimisation.

    Parameters
    ----------
    iterations : int
        Most samples to draw.
    sample_size : int
        Matches in a sample. Three determine a pose and are most likely to be all correct; the papers' RANSAC-50K has 4.
    max_distance : float or None
        Metres; a match agrees with a pose when its residual is smaller. None takes 1.5 times the spacing
        of the matches, or of the scene where they have none.
    edge_ratio : float in [0, 1]
        Least ratio of an edge's shorter to its longer length in the two clouds. 0 accepts all samples.
    confidence : float in [0, 1]
        Stop when an all-inlier sample has been drawn with this probability, assuming that the best support is the true
        inlier count. 1 draws all samples.
    local_optimisation : bool
        Refit the best poses to the matches that agree with them.
    max_matches : int
        More matches are sampled down to this number by weight; noted in the result.
    rival_share : float in [0, 1]
        A pose far from the best one is a rival when its support is at least this share of the best one's.
    backend : "own" or "open3d"
        Open3D shares one generator among its threads: results are not repeatable. It finds no rivals.
    """

    iterations: int = 50_000
    sample_size: int = 3
    max_distance: float | None = None
    edge_ratio: float = 0.9
    confidence: float = 0.999
    local_optimisation: bool = True
    max_matches: int = 5_000
    rival_share: float = 0.5
    backend: Literal["own", "open3d"] = "own"

    needs: ClassVar[frozenset[str]] = frozenset({"matches"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.iterations < 1:
            raise ValueError(f"iterations={self.iterations} must be at least 1")
        if self.sample_size < 3:
            raise ValueError(f"sample_size={self.sample_size} must be at least 3: fewer matches fix no pose")
        if self.max_matches < self.sample_size:
            raise ValueError(
                f"max_matches={self.max_matches} must be at least sample_size={self.sample_size}"
            )
        if self.max_distance is not None and not self.max_distance > 0.0:
            raise ValueError(f"max_distance={self.max_distance} must be a positive length in metres")
        for name in ("edge_ratio", "confidence", "rival_share"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name}={getattr(self, name)} must lie in [0, 1]")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        rows = self._rows(scene, matches, rng)
        if len(rows) < 3:
            return Pose.unknown(len(matches))
        max_distance = self.max_distance or 1.5 * (matches.spacing or scene.spacing)
        source, target, weight = matches.source[rows], matches.target[rows], matches.weight[rows]
        # One thread: how a matrix product is split among threads may decide the last bit of its entries.
        with single():
            if self.backend == "open3d":
                from hybridreg.classical.ransac_open3d import ransac_open3d

                T = ransac_open3d(self, source, target, max_distance, rng)
                found = [] if T is None else [T]
            else:
                found = self._search(Consensus(source, target, weight, max_distance), rng)
        if not found:
            return Pose.unknown(len(matches))
        residual = np.linalg.norm(se3.apply(found[0], matches.source) - matches.target, axis=1)
        return Pose.ranked(found, inliers=residual < max_distance)

    def _rows(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> NDArray[np.int64]:
        finite = np.isfinite(matches.source).all(axis=1) & np.isfinite(matches.target).all(axis=1)
        rows = np.flatnonzero(finite & (matches.weight > 0.0) & np.isfinite(matches.weight))
        if len(rows) <= self.max_matches:
            return rows
        scene.note(f"RANSAC used {self.max_matches} of {len(rows)} matches, drawn by weight (max_matches)")
        share = matches.weight[rows] / matches.weight[rows].sum()
        return np.sort(rng.choice(rows, self.max_matches, replace=False, p=share))

    def _search(self, consensus: Consensus, rng: np.random.Generator) -> list[Array]:
        """Poses, best first."""
        size = min(self.sample_size, len(consensus))
        # The fit to all matches: correct where there are no outliers, or where no sample is wider than the noise.
        T, status = kabsch(consensus.source, consensus.target, consensus.weight)
        poses, counts = [T[None]], [consensus.counts(T[None])]
        if status != "ok":
            counts[0][:] = 0
        best, drawn = int(counts[0][0]), 0
        wanted = self._wanted(best / len(consensus), size)
        while drawn < wanted:
            n = min(_BATCH, self.iterations - drawn)
            poses.append(self._draw(consensus, n, size, rng))
            counts.append(consensus.counts(poses[-1]))
            drawn += n
            if counts[-1].max(initial=0) > best:
                best = self._optimised(consensus, poses[-1][int(counts[-1].argmax())])
                wanted = self._wanted(best / len(consensus), size)
        all_counts = np.concatenate(counts)
        if all_counts.max() < 3:
            return []
        found = modes(
            consensus,
            np.concatenate(poses),
            all_counts,
            refit=self.local_optimisation,
            share=self.rival_share,
        )
        return [one.T for one in found]

    def _draw(self, consensus: Consensus, n: int, size: int, rng: np.random.Generator) -> Array:
        source, target, near = consensus.source, consensus.target, consensus.max_distance
        samples = hypotheses.draw(n, size, consensus.weight, rng)
        samples = hypotheses.rigid(samples, source, target, self.edge_ratio, shortest=near)
        return hypotheses.poses(samples, source, target, near)

    def _optimised(self, consensus: Consensus, T: Array) -> int:
        support = consensus.support(T)
        return consensus.refit(support).n_inliers if self.local_optimisation else support.n_inliers

    def _wanted(self, inlier_ratio: float, size: int) -> float:
        # Number of samples after which one without outliers was drawn with the wanted confidence.
        right = inlier_ratio**size
        if self.confidence >= 1.0 or right <= 0.0:
            return self.iterations
        enough = math.log(1.0 - self.confidence) / math.log1p(-right) if right < 1.0 else 0.0
        return min(enough, self.iterations)
