# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from made_places import Made, make

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import box_world
from hybridreg.pair import Pair
from hybridreg.scene import Scene


@pytest.fixture(scope="session")
def crossing() -> Made:
    """A ring sensor that hangs upside down, 4 m from another make of sensor."""
    world = box_world.street(np.random.default_rng(3), crossing=True)
    return make(
        world,
        "rings32",
        "rings64",
        box_world.sensor_pose(4, 0.3, 1.9, 40, 180),
        box_world.sensor_pose(0, 0, 1.8, 0),
    )


@pytest.fixture(scope="session")
def fan() -> Made:
    """A narrow raster against a full circle, on a yard."""
    world = box_world.yard(np.random.default_rng(5))
    return make(
        world, "raster", "rings64", box_world.sensor_pose(2, 0, 1.5, 25), box_world.sensor_pose(0, 0, 1.8, 0)
    )


@pytest.fixture(scope="session")
def corridor() -> Made:
    """Two walls, a floor and a ceiling without an end in sight."""
    world = box_world.World(ceiling=2.6)
    for y in (-1.3, 1.3):
        world.box(0, y, (400.0, 0.2, 2.6))
    return make(
        world, "rings32", "rings64", box_world.sensor_pose(1, 0, 1.2, 10), box_world.sensor_pose(0, 0, 1.3, 0)
    )


@pytest.fixture(scope="session")
def elsewhere(crossing: Made) -> Scene:
    """The crossing's target with a source from another street."""
    other = make(
        box_world.street(np.random.default_rng(11)),
        "rings32",
        "rings64",
        box_world.sensor_pose(0, 0, 1.8, 40),
        box_world.sensor_pose(3, 0, 1.8, 0),
    )
    return VoxelGrid()(Pair(source=other.scene.pair.source, target=crossing.scene.pair.target))
