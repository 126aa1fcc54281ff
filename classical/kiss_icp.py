# SPDX-License-Identifier: MIT
"""Refinement by KISS-ICP's robust point-to-point registration (Vizzo et al. 2023), through its wheel."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from hybridreg.classical.gicp import not_worse
from hybridreg.config import limits
from hybridreg.geometry import se3
from hybridreg.matches import Pose
from hybridreg.runtime.optional_packages import load
from hybridreg.scene import Scene
from hybridreg.stage import Stage

# The map drops points beyond this range; the target is one scan, none of which should be dropped.
_EVERYTHING = 1e6
# KISS-ICP's density (1.3.0).
_POINTS_PER_VOXEL = 20  # `max_points_per_voxel` of its configuration
_MAP_SAMPLING = 0.5  # voxels; sampling of its map
_SOURCE_SAMPLING = 1.5  # voxels; sampling of its source
_REACH = 3.0  # sigmas


@dataclass(frozen=True, kw_only=True)
class KissIcp(Stage):
    """Align the source to a voxel map of the target with a Geman-McClure kernel.

    KISS-ICP searches correspondences only in the 27 cells around a point, so the map's cells are as long as the
    maximum correspondence distance, and hold more points accordingly. The clouds are sampled as in KISS-ICP, which
    keeps points: centroids of two grids would differ by 3 to 11 cm on identical clouds.

    Parameters
    ----------
    sigma : float or None
        Scale of the kernel, metres; correspondences are searched up to three times as far. None takes 2.5 spacings of
        the levels (KISS-ICP starts at 2 m on vehicle LiDAR).
    voxel : float or None
        Resolution, metres: KISS-ICP's voxel size, of which it keeps 20 points a cell. None takes 1.25 spacings.
    iterations : int
        At most.
    """

    sigma: float | None = None
    voxel: float | None = None
    iterations: int = 500

    def __post_init__(self) -> None:
        super().__post_init__()
        limits.positive(self, "sigma", "voxel")
        limits.at_least(self, 1, "iterations")

    def __call__(self, scene: Scene, pose: Pose) -> Pose:
        VoxelHashMap = load("kiss_icp.mapping", 'refine="kiss-icp"').VoxelHashMap
        Registration = load("kiss_icp.registration", 'refine="kiss-icp"').Registration
        voxel_down_sample = load("kiss_icp.voxelization", 'refine="kiss-icp"').voxel_down_sample

        sigma = self.sigma or 2.5 * scene.spacing
        voxel = self.voxel or 1.25 * scene.spacing
        reach = _REACH * sigma
        cell = max(voxel, reach)
        # It keeps points at least cell / sqrt(points per cell) apart: the same distance in a larger cell.
        points_per_cell = math.ceil(_POINTS_PER_VOXEL * (cell / voxel) ** 2)
        local_map = VoxelHashMap(
            voxel_size=cell, max_distance=_EVERYTHING, max_points_per_voxel=points_per_cell
        )
        # Copies, because it refuses arrays that are read-only, as a cloud's are.
        source, target = (
            voxel_down_sample(cloud.points.copy(), _MAP_SAMPLING * voxel)
            for cloud in (scene.pair.source, scene.pair.target)
        )
        local_map.add_points(target)
        start = np.array(pose.T, dtype=np.float64)
        start[:3, :3] = se3.project(start[:3, :3])  # it ends the process where a rotation is a little off
        registration = Registration(
            max_num_iterations=self.iterations, convergence_criterion=1e-4, max_num_threads=1
        )
        T = registration.align_points_to_map(
            points=voxel_down_sample(source, _SOURCE_SAMPLING * voxel),
            voxel_map=local_map,
            initial_guess=start,
            max_correspondance_distance=reach,
            kernel=sigma,
        )
        return not_worse(scene, pose, np.asarray(T))
