# SPDX-License-Identifier: MIT
"""Pairs of scans of made places, with their true pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.cloud import PointCloud
from hybridreg.data.hard import box_world
from hybridreg.geometry import se3
from hybridreg.pair import Pair
from hybridreg.scene import Scene

Array = NDArray[np.float64]


class Made(NamedTuple):
    scene: Scene
    truth: Array  # T_target_source


def make(
    world: box_world.World, source: str, target: str, T_world_source: Array, T_world_target: Array
) -> Made:
    rng = np.random.default_rng(1)
    clouds = [
        box_world.scan(world, *where, rng) for where in ((source, T_world_source), (target, T_world_target))
    ]
    pair = Pair(source=PointCloud.of(clouds[0]), target=PointCloud.of(clouds[1]))
    return Made(VoxelGrid()(pair), se3.inverse(T_world_target) @ T_world_source)
