# SPDX-License-Identifier: MIT
"""A cloud that holds its place twice, or is put together of two moments, is told; one that does not is not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import box_world
from hybridreg.evidence import views
from hybridreg.evidence.deformation.second_layer import SecondLayer, second_layer
from hybridreg.geometry import se3
from hybridreg.pair import Pair

Array = NDArray[np.float64]
AGAIN = se3.from_rt(se3.yaw(1.0)[:3, :3], np.array([0.9, 0.5, 0.0]))


def scans(seed: int) -> tuple[Array, Array, Array]:
    """Two scans of a crossing (n, 3), and the pose of the first one in the frame of the second (4, 4)."""
    rng = np.random.default_rng(seed)
    world = box_world.street(rng, crossing=True)
    poses = [box_world.sensor_pose(0.0, 0.0, 1.8, 30.0), box_world.sensor_pose(4.0, 1.0, 1.8, -60.0)]
    source, target = (box_world.scan(world, "rings64", pose, rng) for pose in poses)
    return source, target, se3.inverse(poses[1]) @ poses[0]


def layer(source: Array, target: Array, T: Array) -> SecondLayer | None:
    return second_layer(views.of(VoxelGrid(voxel=0.4)(Pair.of(source, target))), T)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_place_held_twice_is_told(seed: int) -> None:
    source, target, truth = scans(seed)
    twice = np.concatenate([source, se3.apply(AGAIN, source)])
    found = layer(twice, target, truth)
    assert found is not None
    assert found.side == "source"
    assert found.metres == pytest.approx(1.0, abs=0.15)
    assert found.degrees == pytest.approx(1.0, abs=0.6)
    back = layer(target, twice, se3.inverse(truth))
    assert back is not None
    assert back.side == "target"
    result = hr.register(twice, target)
    assert result.verdict != "ok"
    assert "hold a place twice" in " ".join(result.reasons)


def test_a_sweep_of_two_moments_is_told() -> None:
    source, target, truth = scans(2)
    half = np.arctan2(source[:, 1], source[:, 0]) > 0.0
    torn = np.where(half[:, None], source, se3.apply(se3.yaw(7.0), source))
    found = layer(torn, target, truth)
    assert found is not None
    assert found.degrees == pytest.approx(7.0, abs=0.5)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_one_place_is_one_layer(seed: int) -> None:
    source, target, truth = scans(seed)
    assert layer(source, target, truth) is None
    near = se3.apply(se3.from_rt(se3.yaw(0.3)[:3, :3], np.array([0.2, 0.1, 0.0])), source)
    assert layer(np.concatenate([source, near]), target, truth) is None
