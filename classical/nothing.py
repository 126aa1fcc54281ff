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
    """Every point counts."""

    def __call__(self, scene: Scene) -> Overlap:
        return Overlap.full(len(scene.source), len(scene.target))


@dataclass(frozen=True, kw_only=True)
class NoMatch(Stage):
    """No matches: for estimators that look at the clouds themselves."""

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        return Correspondences.none()


@dataclass(frozen=True, kw_only=True)
class GivenMatches(Stage):
    """A place for the caller's own matches, `pipe.run(pair, matches=...)`."""

    gives: ClassVar[frozenset[str]] = frozenset({"matches", "group"})

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        raise ValueError(f"pair {scene.pair.id}: this pipeline takes your own matches; call run(pair, matches=...)")


@dataclass(frozen=True, kw_only=True)
class Identity(Stage):
    """The clouds are taken to be aligned already: the start for a refinement, and the row to beat in a table."""

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        return Pose(np.eye(4))


@dataclass(frozen=True, kw_only=True)
class NoRefinement(Stage):
    """The estimated pose as it is."""

    def __call__(self, scene: Scene, pose: Pose) -> Pose:
        return pose
