# SPDX-License-Identifier: MIT
"""The stage that does nothing, for each slot that may stay empty."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.scene import Scene
from hybridreg.stage import Stage


@dataclass(frozen=True, kw_only=True)
class NoOverlap(Stage):
    """Every point takes part."""

    def __call__(self, scene: Scene) -> Overlap:
        return Overlap.full(len(scene.source), len(scene.target))


@dataclass(frozen=True, kw_only=True)
class NoMatch(Stage):
    """No matches: for estimators that work on the clouds themselves."""

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        return Correspondences.none()


@dataclass(frozen=True, kw_only=True)
class GivenMatches(Stage):
    """Placeholder for the caller's own matches, `pipe.run(pair, matches=...)`."""

    gives: ClassVar[frozenset[str]] = frozenset({"matches", "group"})

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        raise ValueError(
            f"pair {scene.pair.id}: this pipeline takes your own matches; call run(pair, matches=...)"
        )


@dataclass(frozen=True, kw_only=True)
class Identity(Stage):
    """The identity pose: the start of a refinement, and the baseline row of a table."""

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        return Pose(np.eye(4))


@dataclass(frozen=True, kw_only=True)
class NoRefinement(Stage):
    """The estimated pose, unchanged."""

    def __call__(self, scene: Scene, pose: Pose) -> Pose:
        return pose
