# SPDX-License-Identifier: MIT
"""Traffic that moves as one stream: a pose that follows it is never "ok"; what is fixed along the road settles it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.data.hard import box_world, sample
from hybridreg.data.hard.true_poses import is_right
from hybridreg.data.loaders.folder import load_pair
from hybridreg.evidence import views
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.pair import Pair


def road(ahead: float, *, gantries: bool = False) -> box_world.World:
    """Four lanes between rails, with vehicles `ahead` metres along them; with gantries, walls face along the road."""
    world, rng = box_world.World(), np.random.default_rng(3)
    for side in (-10.0, 10.0):
        world.box(0.0, side, (190.0, 0.3, 0.8))
    for lane in (-6.2, -2.7, 2.7, 6.2):
        for x in np.arange(-60.0, 60.0, 15.0) + rng.uniform(-2.0, 2.0, 8):
            size = (9.0, 2.5, 3.4) if rng.random() < 0.4 else (4.4, 1.8, 1.5)
            world.box(x + ahead, lane, size)
    if gantries:
        for x in (-31.0, -12.0, 9.0, 24.0):
            for side in (-14.0, 14.0):
                world.box(x, side, (3.0, 5.0, 6.5))
    return world


def scans(
    ahead: float, driven: float, *, gantries: bool = False
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Source, target and the true pose, of a vehicle that drove on while the traffic did."""
    rng = np.random.default_rng(5)
    frames = [box_world.sensor_pose(driven, 0.0, 1.8, 35.0), box_world.sensor_pose(0.0, 0.3, 1.9, -50.0)]
    clouds = [
        box_world.scan(road(moved, gantries=gantries), sensor, frame, rng)
        for moved, sensor, frame in zip((ahead, 0.0), ("rings64", "rings32"), frames, strict=True)
    ]
    return clouds[0], clouds[1], se3.inverse(frames[1]) @ frames[0]


@pytest.mark.parametrize(("ahead", "driven"), [(5.0, 0.0), (8.0, 8.0)])
def test_a_pose_that_follows_the_traffic_is_not_ok(ahead: float, driven: float) -> None:
    source, target, truth = scans(ahead, driven)
    result = hr.register(source, target)
    assert np.linalg.norm((se3.inverse(truth) @ result.transformation)[:3, 3]) > 2.0
    assert result.verdict == "doubtful"
    assert "things no larger than vehicles" in " ".join(result.reasons)


@pytest.mark.parametrize("gantries", [False, True])
def test_walls_across_the_road_settle_it(gantries: bool) -> None:
    # Here the traffic stands still, which nothing else shows.
    source, target, truth = scans(0.0, 2.0, gantries=gantries)
    result = hr.register(source, target)
    assert np.linalg.norm((se3.inverse(truth) @ result.transformation)[:3, 3]) < 0.3
    assert ("no larger than vehicles" in " ".join(result.reasons)) != gantries
    assert result.verdict == ("ok" if gantries else "doubtful")


@pytest.mark.parametrize("seed", [442])
def test_no_motorway_is_ok_at_a_wrong_pose(seed: int) -> None:
    made = sample("traffic", seed)
    result = hr.register(made.source, made.target)
    assert is_right(made, result.transformation) or result.verdict != "ok"


@pytest.mark.parametrize("name", ["kitti-city-20-to-0", "kitti-odo-5-to-0"])
def test_a_slice_of_a_street_is_not_taken_for_traffic(real_data: Path, name: str) -> None:
    # Cropped by height, walls are no taller than cars.
    made = load_pair(real_data / name)
    source, target = (
        cloud.points[(cloud.points[:, 2] > -0.7) & (cloud.points[:, 2] < 0.8)]
        for cloud in (made.pair.source, made.pair.target)
    )
    both = views.of(VoxelGrid()(Pair.of(source, target)))
    assert PoseEvidence(both, made.T_target_source).traffic is None
