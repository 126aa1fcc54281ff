# SPDX-License-Identifier: MIT
"""Hierarchical correspondence filtering (Zhao et al., VRHCF, ICME 2024) as an estimator for any matches."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from hybridreg.classical.hcf.compatibility import first_order, leading_eigenvectors, pick_seeds, second_order
from hybridreg.classical.hcf.consensus_sets import filter_sets, first_sets, set_poses, set_weights
from hybridreg.classical.pose_modes import modes, same
from hybridreg.config import limits
from hybridreg.geometry import se3
from hybridreg.geometry.consensus import Consensus
from hybridreg.geometry.kabsch import kabsch
from hybridreg.matches import Correspondences, Pose
from hybridreg.scene import Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]
Rows = NDArray[np.int64]


@dataclass(frozen=True, kw_only=True)
class Hcf(Stage):
    """Sets of mutually compatible matches, halved until few are left, give poses; the best one is refined.

    Deterministic. Memory grows with the square of the number of matches (100 MB at 5,000).

    Parameters
    ----------
    max_distance : float or None
        Metres; a match agrees with a pose when its residual is smaller. None takes 1.5 times the spacing of the
        matches, or of the scene where they have none. Published: 0.1 indoors, 0.6 on KITTI.
    reach : float or None
        Metres by which distances between two right matches may differ. None: as `max_distance`, as published.
    nms_radius : float or None
        Metres; a seed is the most confident match within it. None: as `max_distance`, as published.
    refine_distance : float or None
        Metres within which matches take part in the refinement. None: twice `max_distance`. The released code takes
        1.2 m whatever was asked for, but 0.1 m where the inlier threshold is exactly 0.1 (module/HCF_module.py,
        post_refinement); 1.2 and 0.1 here reproduce its numbers.
    seed_share : float in (0, 1]
        Number of seeds as a share of the matches.
    set_size : int
        Matches collected around a seed. With fewer matches in all, sets of four, which are not halved.
    kept_share : float in (0, 1)
        Share of a set that each halving keeps.
    final_size : int
        Sets are halved while they are larger. Published: 15, which ends at 12.
    iterations : int
        Of the power iteration, at most.
    refine_steps : int
        At most; the refinement ends when the number of agreeing matches repeats.
    max_matches : int
        Of more matches those with the largest weights are used, of equals the first; noted in the result. The released
        code takes the first 8,000, which is the same where all weights are one.
    rival_share : float in [0, 1]
        A pose far from the best one is a rival when its support is at least this share of the best one's.
    """

    max_distance: float | None = None
    reach: float | None = None
    nms_radius: float | None = None
    refine_distance: float | None = None
    seed_share: float = 0.2
    set_size: int = 200
    kept_share: float = 0.5
    final_size: int = 15
    iterations: int = 10
    refine_steps: int = 20
    max_matches: int = 5_000
    rival_share: float = 0.5

    needs: ClassVar[frozenset[str]] = frozenset({"matches"})

    def __post_init__(self) -> None:
        super().__post_init__()
        limits.positive(self, "max_distance", "reach", "nms_radius", "refine_distance")
        limits.at_least(self, 1, "iterations")
        limits.at_least(self, 3, "set_size", "final_size", "max_matches")
        limits.at_least(self, 0, "refine_steps")
        limits.within(self, 0.0, 1.0, "rival_share")
        if not 0.0 < self.seed_share <= 1.0:
            raise ValueError(f"seed_share={self.seed_share} must lie in (0, 1]")
        if not 0.0 < self.kept_share < 1.0:
            raise ValueError(
                f"kept_share={self.kept_share} must lie in (0, 1): sets would never become small"
            )

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        rows = self._rows(scene, matches)
        if len(rows) < 3:
            return Pose.unknown(len(matches))
        near = self.max_distance or 1.5 * (matches.spacing or scene.spacing)
        source, target = matches.source[rows], matches.target[rows]
        # One BLAS thread: how a product is split among threads may decide the last bit, and with it a seed.
        with threadpool_limits(limits=1, user_api="blas"):
            poses = self.poses(source, target, near)
            consensus = Consensus(source, target, matches.weight[rows], near)
            counts = consensus.counts(poses)
            best = int(counts.argmax())
            if counts[best] < 3:
                return Pose.unknown(len(matches))
            T = self.refined(source, target, poses[best], self.refine_distance or 2.0 * near)
            found = modes(consensus, poses, counts, refit=True, share=self.rival_share)
        residual = np.linalg.norm(se3.apply(T, matches.source) - matches.target, axis=1)
        far = np.array([one.T for one in found]).reshape(-1, 4, 4)
        far = far[~same(far, T, np.median(source, axis=0), consensus)]
        return Pose(T, inliers=residual < near, rivals=far)

    def poses(self, source: Array, target: Array, max_distance: float) -> Array:
        """One pose (S, 4, 4) for each seed among matches (K, 3), (K, 3), the most confident seed first."""
        soft = first_order(source, target, self.reach or max_distance)
        confidence = leading_eigenvectors(soft[None], self.iterations)[0][0]
        count = max(1, int(len(source) * self.seed_share))
        seeds = pick_seeds(source, confidence, self.nms_radius or max_distance, count)
        sets = first_sets(second_order(soft, seeds.rows), self.set_size)
        steps = filter_sets(soft, sets, self.kept_share, self.final_size)
        sets = steps[-1].sets if steps else sets
        weights, _ = set_weights(soft, sets, self.iterations)
        return set_poses(source, target, sets, weights)

    def refined(self, source: Array, target: Array, T: Array, near: float) -> Array:
        """A pose (4, 4) refitted repeatedly to the matches within ``near`` metres, near ones weighing more."""
        steps = self.refinement(source, target, T, near)
        return steps[-1][1] if steps else T

    def refinement(self, source: Array, target: Array, T: Array, near: float) -> list[tuple[int, Array]]:
        """Each fit of the refinement: the number of matches used, and the pose (4, 4)."""
        steps: list[tuple[int, Array]] = []
        before = 0
        for _ in range(self.refine_steps):
            residual = np.linalg.norm(se3.apply(T, source) - target, axis=1)
            inliers = residual < near
            count = int(inliers.sum())
            if count == before:
                break
            weight = 1.0 / (1.0 + (residual[inliers] / near) ** 2)
            fitted, status = kabsch(source[inliers], target[inliers], weight)
            if status in ("few", "nan"):
                break
            T, before = fitted, count
            steps.append((count, T))
        return steps

    def _rows(self, scene: Scene, matches: Correspondences) -> Rows:
        finite = np.isfinite(matches.source).all(axis=1) & np.isfinite(matches.target).all(axis=1)
        rows = np.flatnonzero(finite & (matches.weight > 0.0) & np.isfinite(matches.weight))
        if len(rows) <= self.max_matches:
            return rows
        scene.note(f"HCF used the {self.max_matches} heaviest of {len(rows)} matches (max_matches)")
        heaviest = np.argsort(-matches.weight[rows], kind="stable")[: self.max_matches]
        return np.sort(rows[heaviest])
