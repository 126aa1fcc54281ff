# SPDX-License-Identifier: MIT
"""Pose by correlation of the ground relief of both clouds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.overhead.relief_climb import climb, laid
from hybridreg.classical.overhead.relief_sweep import COARSE, search
from hybridreg.config import limits
from hybridreg.evidence import views
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Pose
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import as_pose
from hybridreg.search.ranking import distinct
from hybridreg.search.settle import best_first, resting
from hybridreg.stage import Stage

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class ReliefSearch(Stage):
    """Search all yaws and shifts for the best correlation of the ground relief.

    Each cloud's relief (`hybridreg.geometry.ground_relief`) is a height map with gaps; the maps are correlated at every
    yaw and shift (`hybridreg.classical.overhead.relief_sweep`), and the best poses ranked by their log-odds, as they
    are and settled on the surfaces. For open ground, where little else constrains a pose; without ground in both clouds
    no pose is found.

    Parameters
    ----------
    farthest : float
        Largest distance between the sensors along the ground, metres.
    tries : int
        Poses settled and ranked, at most.
    """

    farthest: float = 60.0
    tries: int = 8

    def __post_init__(self) -> None:
        super().__post_init__()
        limits.positive(self, "farthest")
        limits.at_least(self, 1, "tries")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        both = views.of(scene)
        source, target = both.source.relief, both.target.relief
        if source is None or target is None:
            scene.note("relief search: no ground found in both clouds")
            return Pose.unknown()
        planar = search(source, target, self.farthest, self.tries)
        if not planar:
            scene.note("relief search: too little ground that both clouds show")
            return Pose.unknown()
        T_target_level = se3.inverse(target.T_level_cloud)
        poses = [
            T_target_level @ laid(source, target, M) @ source.T_level_cloud
            for M in climb(source, target, planar, COARSE * target.cell)
        ]
        # What pulls on a field are the few things that stand on it, which may draw a pose off its ground.
        found = [*best_first(scene, poses), *resting(scene, poses)]
        return as_pose(distinct(scene, found))
