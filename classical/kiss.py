# SPDX-License-Identifier: MIT
"""KISS-Matcher (Lim et al. 2025), through its wheel: features, pruning and pose in one."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.config import limits
from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.matches import Correspondences, Pose
from hybridreg.runtime import optional_packages as wheels
from hybridreg.runtime.cores import n_threads
from hybridreg.runtime.threads import on_one_core, single
from hybridreg.scene import Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]

# Its C++ code (1.0.2) segfaults on clouds where no point has a neighbourhood to describe. In 1,500 random clouds all
# 225 crashes had no point with five neighbours within the radius of its normals; twice as much is required here.
_SUPPORTED_POINTS = 10  # points with a neighbourhood, at least; by hand
_NEIGHBOURS = 6  # of such a point, itself included
_NORMAL_RADIUS = 3.0  # voxels; the radius of the wheel's normals
_FEWEST_MATCHES = 3
_SMALLEST_VOXEL = 0.01  # metres; below half of it the wheel raises RuntimeError
_LARGEST_NOISE = 0.999


@dataclass(frozen=True, kw_only=True)
class KissMatcher(Stage):
    """Register the whole clouds at one voxel size.

    The right size depends on the pair, and the matcher's own inlier count does not reveal it on clouds of different
    sensors: let `Candidates` try several.

    Equal calls give equal bits, unless the wheel (1.0.2) was used before in this process, outside this stage, on more
    than one core: then 40 calls gave two poses, 0.26 m apart, at a 0.3 m voxel.

    Parameters
    ----------
    voxel : float or None
        Metres; None takes `scale`.
    scale : float
        Voxel in spacings of the levels.
    max_matches : int
        KISS-Matcher keeps at most this many initial matches.
    """

    wheels: ClassVar[tuple[str, ...]] = ("kiss_matcher",)

    voxel: float | None = None
    scale: float = 1.25
    max_matches: int = 5000

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("voxel", "scale"):
            value = getattr(self, name)
            if value is not None and not 0.0 < value < np.inf:
                raise ValueError(f"{name}={value} must be a positive number")
        limits.at_least(self, _FEWEST_MATCHES, "max_matches")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        voxel = self.voxel or self.scale * scene.spacing
        T = self._at(scene, voxel)
        if T is None:
            scene.note(f"KISS-Matcher found no pose at a voxel of {voxel:.3g} m")
            return Pose.unknown()
        return Pose(T)

    def _at(self, scene: Scene, voxel: float) -> Array | None:
        kiss_matcher = _wheel()
        # Its own voxel grid depends on a race between threads; ours makes the result repeatable.
        source = voxel_centroids(scene.pair.source.points, voxel)
        target = voxel_centroids(scene.pair.target.points, voxel)
        if not (_describable(source, voxel) and _describable(target, voxel)):
            return None
        # The unit of small scenes makes no difference to it, except for this limit.
        magnified = max(1.0, _SMALLEST_VOXEL / voxel)
        source, target, voxel = magnified * source, magnified * target, magnified * voxel
        # It clamps both noise bounds at a metre, and prints a warning where it does; so clamp before.
        config = kiss_matcher.KISSMatcherConfig(
            voxel,
            use_voxel_sampling=False,
            num_max_corr=self.max_matches,
            robin_noise_bound_gain=min(1.0, _LARGEST_NOISE / voxel),
            solver_noise_bound_gain=min(0.75, _LARGEST_NOISE / voxel),
        )
        matcher = kiss_matcher.KISSMatcher(config)
        with single():  # otherwise its pruning has a race, and hangs in a forked process
            found_source, found_target = matcher.match(source.T, target.T)
            if len(found_source) < _FEWEST_MATCHES:
                return None
            solution = matcher.prune_and_solve(found_source, found_target)
        # `valid` (1.0.2) only says that there was something to solve; a pose with fewer inliers is arbitrary.
        if not solution.valid or matcher.get_num_final_inliers() < _FEWEST_MATCHES:
            return None
        T = np.eye(4)
        T[:3, :3], T[:3, 3] = solution.rotation, np.ravel(solution.translation) / magnified
        return T if np.isfinite(T).all() else None


@lru_cache(maxsize=1)
def _wheel() -> Any:
    kiss_matcher = wheels.load("kiss_matcher", 'estimate="kiss"')
    # It has threads of two kinds, which race: 1 match in 30 differed from the others. `single` limits OpenMP's. It
    # sets the number of the others from the cores at the first match of a process; where it sees one core, all of 600
    # later matches were the same (1.0.2, Linux).
    points = np.random.default_rng(0).uniform(size=(3, 300))
    with on_one_core(), single():
        kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(0.2, use_voxel_sampling=False)).match(
            points, points
        )
    return kiss_matcher


def _describable(points: Array, voxel: float) -> bool:
    counts = cKDTree(points).query_ball_point(
        points, _NORMAL_RADIUS * voxel, return_length=True, workers=n_threads()
    )
    return int(np.count_nonzero(counts >= _NEIGHBOURS)) >= _SUPPORTED_POINTS
