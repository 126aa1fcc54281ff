# SPDX-License-Identifier: MIT
"""Local-to-global registration as a stage."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.pose_modes import modes, same
from hybridreg.geometry import se3
from hybridreg.geometry.consensus import Consensus
from hybridreg.geometry.kabsch import kabsch
from hybridreg.matches import Correspondences, Pose
from hybridreg.runtime.threads import single
from hybridreg.runtime.torch_settings import as_torch_begins
from hybridreg.scene import Scene
from hybridreg.stage import Stage

if TYPE_CHECKING:
    from hybridreg.learned.cross3dreg.config import LgrConfig
    from hybridreg.learned.matching.local_to_global import LgrEstimate

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

# The published fit adds 1e-5 to the sum of the weights, which pulls it towards the origin where they are small.
_LARGEST_WEIGHT = 1e6


@dataclass(frozen=True, kw_only=True)
class Lgr(Stage):
    """Each group of matches proposes a pose, all matches vote, inliers refine it (GeoTransformer, section 3.4).

    Parameters
    ----------
    max_distance : float or None
        Metres; a match agrees with a pose when its residual is smaller. None takes that of `weights`; without them the
        spacing of the points that were matched where the matcher tells it (twice the voxel of the published networks,
        as they do), and otherwise twice the scene's spacing.
    min_group : int or None
        Groups of fewer matches propose nothing, but vote. None takes that of `weights`, or 3.
    steps : int or None
        Fits to the matches that agree. None takes that of `weights`, or 5.
    max_votes : int or None
        At most so many matches vote, those of the largest weight. None takes that of `weights`; without them all vote.
    weights : str or None
        A folder of a network's weights, or the name of shipped ones, whose configuration (`LgrConfig`) fills what is
        None above: the same numbers as in that network's validation while it was trained.
    rival_share : float in [0, 1]
        A pose far from the best one is a rival when its support is at least this share of the best one's.
    guided : bool
        Ours: match all points anew near where LGR's pose puts them, and near where three poses of upright clouds do
        that all similar points vote for; the one that these support most goes on
        (`hybridreg.learned.matching.guided_search`). Needs a matcher that hands on its features.
    """

    max_distance: float | None = None
    min_group: int | None = None
    steps: int | None = None
    max_votes: int | None = None
    weights: str | None = None
    rival_share: float = 0.5
    guided: bool = False

    needs: ClassVar[frozenset[str]] = frozenset({"matches", "group"})

    def __post_init__(self) -> None:
        if isinstance(self.weights, os.PathLike):
            object.__setattr__(self, "weights", os.fspath(self.weights))
        super().__post_init__()
        if self.max_distance is not None and not self.max_distance > 0.0:
            raise ValueError(f"max_distance={self.max_distance} must be a positive length in metres")
        if self.min_group is not None and self.min_group < 3:
            raise ValueError(f"min_group={self.min_group} must be at least 3: fewer matches fix no pose")
        if self.steps is not None and self.steps < 1:
            raise ValueError(f"steps={self.steps} must be at least 1")
        if self.max_votes is not None and self.max_votes < 1:
            raise ValueError(f"max_votes={self.max_votes} must be at least 1")
        if not 0.0 <= self.rival_share <= 1.0:
            raise ValueError(f"rival_share={self.rival_share} must lie in [0, 1]")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        rows = _usable(matches)
        config = self.config(matches.spacing or 2.0 * scene.spacing)
        with as_torch_begins(), single():
            found = None if len(rows) < 3 else _estimate(scene, matches, rows, config)
            T: Array | None = None if found is None else found.transform.numpy()
            if self.guided:
                T = _guided(scene, matches, [] if T is None else [T])
            if T is None:
                return Pose.unknown(len(matches))
            residual = np.linalg.norm(se3.apply(T, matches.source[rows]) - matches.target[rows], axis=1)
            inliers = np.zeros(len(matches), dtype=bool)
            inliers[rows] = residual < config.acceptance_radius
            _, status = kabsch(matches.source[inliers], matches.target[inliers], matches.weight[inliers])
            if status in ("few", "nan") and not self.guided:
                return Pose.unknown(len(matches))
            if status == "degenerate":
                scene.note("the matches that agree lie on one line: the rotation about it is arbitrary")
            if found is None:
                return Pose(T, inliers=inliers)
            rivals = self._rivals(matches, rows, T, found.proposals.numpy(), config.acceptance_radius)
        return Pose(T, inliers=inliers, rivals=rivals)

    def config(self, spacing: float) -> LgrConfig:
        """What this stage works with where points are ``spacing`` metres apart.

        Raises
        ------
        FileNotFoundError, ValueError
            `weights` are not there, or of a network that has no such configuration.
        """
        from hybridreg.learned.cross3dreg.config import LgrConfig

        own = LgrConfig(acceptance_radius=spacing) if self.weights is None else _of_weights(self.weights)
        given: dict[str, Any] = {
            "acceptance_radius": self.max_distance,
            "min_group": self.min_group,
            "steps": self.steps,
            "max_votes": self.max_votes,
        }
        return replace(own, **{key: value for key, value in given.items() if value is not None})

    def _rivals(
        self, matches: Correspondences, rows: Rows, T: Array, proposals: Array, max_distance: float
    ) -> Array:
        source, target, weight = matches.source[rows], matches.target[rows], matches.weight[rows]
        consensus = Consensus(source, target, weight, max_distance)
        poses = np.concatenate([T[None], proposals])
        found = modes(consensus, poses, consensus.counts(poses), refit=True, share=self.rival_share)
        far = np.array([one.T for one in found]).reshape(-1, 4, 4)
        return far[~same(far, T, np.median(source, axis=0), consensus)]


def _guided(scene: Scene, matches: Correspondences, starts: list[Array]) -> Array | None:
    from hybridreg.learned.matching.guided_search import search

    if matches.described is None:
        raise ValueError(
            f"pair {scene.pair.id}: guided matching compares features of all points, and this match stage hands on "
            "none; use geotransformer or vgam, or guided = false"
        )
    return search(starts, *matches.described, matches.spacing or scene.spacing)


def _usable(matches: Correspondences) -> Rows:
    finite = np.isfinite(matches.source).all(axis=1) & np.isfinite(matches.target).all(axis=1)
    return np.flatnonzero(finite & (matches.weight > 0.0) & np.isfinite(matches.weight))


def _estimate(scene: Scene, matches: Correspondences, rows: Rows, config: LgrConfig) -> LgrEstimate:
    import torch

    from hybridreg.learned.matching.local_to_global import local_to_global

    if matches.group is None:
        raise ValueError(
            f"pair {scene.pair.id}: local-to-global estimation needs to know which matches belong together; "
            f"give the {len(matches)} matches a group (K,), or use an estimator that needs none"
        )
    weight = matches.weight[rows] * (_LARGEST_WEIGHT / matches.weight[rows].max())
    columns = (matches.target[rows], matches.source[rows], weight, matches.group[rows])
    target, source, weights, group = (torch.from_numpy(np.array(column)) for column in columns)
    found = local_to_global(target, source, weights, group, config)
    if found.hypotheses == 0:
        scene.note(f"LGR: no group has {config.min_group} matches, it started from a fit to all of them")
    return found


def _of_weights(weights: str) -> LgrConfig:
    from hybridreg.learned.weights import read_config

    found: LgrConfig | None = getattr(read_config(weights), "lgr", None)
    if found is None:
        raise ValueError(
            f"Lgr: the weights {weights!r} are of a network that has no local-to-global estimation"
        )
    return found
