# SPDX-License-Identifier: MIT
"""Refinement by generalised ICP (Segal et al. 2009), through the small_gicp wheel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.config import limits
from hybridreg.geometry import se3
from hybridreg.geometry.fitness import measure
from hybridreg.matches import Pose
from hybridreg.runtime.cores import n_threads
from hybridreg.runtime.optional_packages import load
from hybridreg.scene import Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]

_FEWEST_NEIGHBOURS = 3  # span a plane
_FEWEST = 11  # source points near the target: with fewer small_gicp (1.0.1) writes warnings to the terminal
# Steps at which a round has converged.
_STILL_RAD = 1e-5  # radians, by hand
_STILL_M = 1e-4  # metres, by hand
_COARSE = 100.0  # factor on both in the rounds before the last, by hand
# Of the source points that lay on the target before, the share that must still do so afterwards.
_KEPT = 0.9
# Points farther from the target than this multiple of the widest search are left out.
_FAR = 2.0


@dataclass(frozen=True, kw_only=True)
class Gicp(Stage):
    """Align the local surfaces of both clouds, coarse to fine.

    Parameters
    ----------
    voxel : float or None
        Voxel at which the clouds are compared, metres; None takes a share of the levels' spacing.
    fineness : float
        That share. A coarser grid takes less time and is a little less exact.
    max_distances : tuple of float or None
        Maximum correspondence distance of each round, metres; None takes 5, 2.5 and 1.25 spacings.
    neighbours : int
        Points from which a surface's covariance is estimated.
    iterations : int
        At most, in each round.
    """

    voxel: float | None = None
    fineness: float = 0.6
    max_distances: tuple[float, ...] | None = None
    neighbours: int = 20
    iterations: int = 30

    def __post_init__(self) -> None:
        super().__post_init__()
        limits.positive(self, "voxel", "fineness", "max_distances")
        limits.at_least(self, _FEWEST_NEIGHBOURS, "neighbours")
        limits.at_least(self, 1, "iterations")

    def __call__(self, scene: Scene, pose: Pose) -> Pose:
        small_gicp = load("small_gicp", 'refine="gicp"')
        voxel = self.voxel or self.fineness * scene.spacing
        distances = self.max_distances or (5 * scene.spacing, 2.5 * scene.spacing, 1.25 * scene.spacing)
        T = pose.T
        near = _within(scene, T, voxel, _FAR * max(distances))
        if len(near) < _FEWEST:
            return pose
        source, _ = _surfaces(near, self.neighbours)
        level = scene.at(voxel).target
        target, target_tree = level.once(
            ("small_gicp", self.neighbours), lambda: _surfaces(level.points, self.neighbours)
        )
        rests = False
        for distance in distances:
            last = distance == distances[-1]
            # What converged at once also converges at a smaller distance. Only the last round needs to converge
            # exactly.
            if rests and not last:
                continue
            still = 1.0 if last else _COARSE
            # One thread (`hybridreg.runtime.threads`): with more, the order of summation, and hence the last digits,
            # depend on the machine.
            found = small_gicp.align(
                target,
                source,
                target_tree,
                init_T_target_source=T,
                max_correspondence_distance=distance,
                max_iterations=self.iterations,
                rotation_epsilon=still * _STILL_RAD,
                translation_epsilon=still * _STILL_M,
                num_threads=1,
            )
            # `iterations` (1.0.1) is the number of the last step, from zero, even where it ran out of steps.
            T, rests = found.T_target_source, found.converged and found.iterations == 0
        return not_worse(scene, pose, np.asarray(T))


def not_worse(scene: Scene, before: Pose, T: Array) -> Pose:
    """The refined pose, unless far fewer source points lie on the target than before (docs/methods.md 9.6).

    small_gicp reports convergence even where it slid away or had no correspondences left, so the count decides. It may
    drop a little: a pose that is a degree off can bring more points of sparse rings near one another than the true
    one.
    """
    if not np.isfinite(T).all():
        return before
    on = [
        measure(scene.source.points, scene.target.tree, M, 1.25 * scene.spacing).fitness
        for M in (before.T, T)
    ]
    return replace(before, T=T) if on[1] >= _KEPT * on[0] else before


def _within(scene: Scene, T: Array, voxel: float, reach: float) -> Array:
    # The source's points (n, 3), without those that have no correspondence. small_gicp searches the nearest point at
    # any distance, and takes longer the farther it is: a third of the time for a right pose, half a minute for one
    # that moves most points away from the target.
    points = scene.at(voxel).source.points
    distance, _ = scene.target.tree.query(
        se3.apply(T, points), distance_upper_bound=reach, workers=n_threads()
    )
    return points[np.isfinite(distance)]


def _surfaces(points: Array, neighbours: int) -> tuple[Any, Any]:
    small_gicp = load("small_gicp", 'refine="gicp"')
    cloud = small_gicp.PointCloud(points)
    kd_tree = small_gicp.KdTree(cloud, num_threads=1)
    small_gicp.estimate_covariances(cloud, kd_tree, min(neighbours, cloud.size()), 1)
    return cloud, kd_tree
