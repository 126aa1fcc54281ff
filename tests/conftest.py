# SPDX-License-Identifier: MIT
"""Fixtures that several areas share."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import hypothesis
import numpy as np
import pytest
from made_places import Made, make
from numpy.typing import NDArray

from hybridreg import testing
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import box_world
from hybridreg.pair import Pair
from hybridreg.scene import Scene

# Wall-clock deadlines fail on a busy machine; a fixed seed lets a failure be seen again.
hypothesis.settings.register_profile("repeatable", deadline=None, derandomize=True)
hypothesis.settings.load_profile("repeatable")

# A shell that runs the suite in the background leaves SIGINT ignored, and every process that a test starts would too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def real_data() -> Path:
    """Folder of real sensor pairs; the test skips where it is not."""
    folder = Path(os.environ.get("HYBRIDREG_DATA", ROOT.parent / "shared" / "data")) / "real"
    if not folder.is_dir():
        pytest.skip(f"no real pairs at {folder}")
    return folder


@pytest.fixture
def courtyard() -> tuple[Pair, NDArray[np.float64]]:
    """A made pair that is easy to register, and its true pose."""
    return testing.sample_pair()


@pytest.fixture
def courtyard_scene() -> tuple[Scene, NDArray[np.float64]]:
    return testing.sample_scene()


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
