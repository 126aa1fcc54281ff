# SPDX-License-Identifier: MIT
"""Refinement by KISS-ICP's robust point-to-point registration (Vizzo et al. 2023), through its wheel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridreg import limits
from hybridreg.classical.gicp import not_worse
from hybridreg.classical.voxel import voxel_centroids
from hybridreg.matches import Pose
from hybridreg.scene import Scene
from hybridreg.stage import Stage
from hybridreg.wheels import load

# The map drops points beyond this range; the target is one scan, nothing of it is to be dropped.
_EVERYTHING = 1e6
_POINTS_PER_VOXEL = 20


@dataclass(frozen=True, kw_only=True)
class KissIcp(Stage):
    """Align the source to a voxel map of the target with a Geman-McClure kernel.

    Parameters
    ----------
    sigma : float or None
        Scale of the kernel, metres; partners are sought up to three times as far. None takes 2.5 spacings of the
        levels (KISS-ICP starts at 2 m on vehicle LiDAR).
    voxel : float or None
        Cell of the map, metres; None takes 1.25 spacings.
    iterations : int
        At most.
    """

    sigma: float | None = None
    voxel: float | None = None
    iterations: int = 500

    def __post_init__(self) -> None:
        limits.positive(self, "sigma", "voxel")
        limits.at_least(self, 1, "iterations")

    def __call__(self, scene: Scene, pose: Pose) -> Pose:
        VoxelHashMap = load("kiss_icp.mapping", 'refine="kiss-icp"').VoxelHashMap
        Registration = load("kiss_icp.registration", 'refine="kiss-icp"').Registration

        sigma = self.sigma or 2.5 * scene.spacing
        voxel = self.voxel or 1.25 * scene.spacing
        local_map = VoxelHashMap(
            voxel_size=voxel, max_distance=_EVERYTHING, max_points_per_voxel=_POINTS_PER_VOXEL
        )
        local_map.add_points(voxel_centroids(scene.pair.target.points, 0.5 * voxel))
        registration = Registration(
            max_num_iterations=self.iterations, convergence_criterion=1e-4, max_num_threads=1
        )
        T = registration.align_points_to_map(
            points=voxel_centroids(scene.pair.source.points, 1.5 * voxel),
            voxel_map=local_map,
            initial_guess=pose.T,
            max_correspondance_distance=3.0 * sigma,
            kernel=sigma,
        )
        return not_worse(scene, pose, np.asarray(T))
