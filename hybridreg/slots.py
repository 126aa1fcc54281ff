# SPDX-License-Identifier: MIT
"""The five slots of a pipeline, as protocols: a stage conforms by its signature, without importing anything.

A stage may also carry `needs` and `gives`, sets of the words below, so that a pipeline can refuse stages that do not
fit when it is built: "image", "matches", "group".
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.pair import Pair
from hybridreg.scene import Scene

SLOTS = ("downsample", "overlap", "match", "estimate", "refine")


class Downsample(Protocol):
    """Make the two levels that the later stages work on."""

    def __call__(self, pair: Pair, /) -> Scene: ...


class FindOverlap(Protocol):
    """Find which points lie in the part that both sensors saw."""

    def __call__(self, scene: Scene, /) -> Overlap: ...


class Match(Protocol):
    """Pair points of the source with points of the target."""

    def __call__(self, scene: Scene, overlap: Overlap, /) -> Correspondences: ...


class Estimate(Protocol):
    """Find the pose, from the matches or from the clouds themselves."""

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator, /) -> Pose: ...


class Refine(Protocol):
    """Improve a pose that is nearly right."""

    def __call__(self, scene: Scene, pose: Pose, /) -> Pose: ...
