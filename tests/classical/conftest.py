# SPDX-License-Identifier: MIT
from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from made_matches import street

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.cloud import PointCloud
from hybridreg.pair import Pair
from hybridreg.scene import Scene


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.fixture(scope="session")
def make_scene() -> Callable[..., Scene]:
    def make(source: np.ndarray, target: np.ndarray, voxel: float = 0.4, id: str = "test") -> Scene:
        pair = Pair(source=PointCloud.of(source), target=PointCloud.of(target), id=id)
        return VoxelGrid(voxel=voxel)(pair)

    return make


@pytest.fixture
def scene(make_scene: Callable[..., Scene]) -> Scene:
    return make_scene(street(0), street(0))
