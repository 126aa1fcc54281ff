# SPDX-License-Identifier: MIT
"""A place that repeats, one bay on: the pose that puts one sensor where the other stood is never "ok"."""

from __future__ import annotations

import re

import numpy as np
import pytest
from made_places import Made, make

import hybridreg as hr
from hybridreg.data.hard import box_world
from hybridreg.evidence import views
from hybridreg.geometry import se3

BAY = 7.5


def hall() -> box_world.World:
    """Columns in rows, under a ceiling; its ends are far away."""
    world = box_world.World(ceiling=2.8)
    for x in np.arange(-12, 13) * BAY:
        for y in np.arange(-6, 7) * 8.0:
            world.box(x, y + 1.0, (0.6, 0.6, 2.8))
    return world


def truss_bridge() -> box_world.World:
    """Posts every six metres, rails and beams across."""
    world = box_world.World()
    for x in np.arange(-20, 21) * 6.0:
        for y in (-5.5, 5.5):
            world.box(x, y, (0.4, 0.4, 6.0))
    for y in (-6.0, 6.0):
        world.box(0.0, y, (240.0, 0.2, 1.0))
    return world


def scanned(world: box_world.World, along: float, yaw_deg: float = 0.0) -> Made:
    """Twice by one kind of sensor, which moved so far along, and a little aside."""
    there = box_world.sensor_pose(1.0 + along, 4.1, 1.6, 20.0 + yaw_deg)
    return make(world, "rings16", "rings16", box_world.sensor_pose(1.0, 4.0, 1.6, 20.0), there)


def apart(T: np.ndarray, truth: np.ndarray) -> float:
    return float(np.linalg.norm(T[:3, 3] - truth[:3, 3]))


@pytest.mark.parametrize(
    ("world", "along", "yaw_deg"),
    [
        (hall(), BAY + 0.1, 0.0),
        (hall(), -BAY, 15.0),
        (truss_bridge(), 6.0, -10.0),
        (truss_bridge(), 11.9, 0.0),
    ],
)
def test_a_bay_on_it_is_not_ok(world: box_world.World, along: float, yaw_deg: float) -> None:
    made = scanned(world, along, yaw_deg)
    result = hr.register(made.scene.pair.source.points, made.scene.pair.target.points)
    assert result.verdict != "ok" or apart(result.transformation, made.truth) < 0.5


def test_the_reason_says_so_and_what_it_names_settles_it() -> None:
    made = scanned(hall(), 0.1)
    source, target = (cloud.points for cloud in (made.scene.pair.source, made.scene.pair.target))
    result = hr.register(source, target)
    assert result.verdict == "doubtful"
    told = re.search(r"seen from nearly one place.*max_translation=([\d.]+)", " ".join(result.reasons))
    assert told, result.reasons
    assert len(result.rivals)  # which the reason points to
    started = hr.register(source, target, init=made.truth, max_translation=float(told[1]))
    assert started.verdict == "ok", started.reasons
    assert apart(started.transformation, made.truth) < 0.1


def test_where_nothing_repeats_one_place_is_as_good_as_another(crossing: Made) -> None:
    pair = crossing.scene.pair
    twice = make(
        box_world.street(np.random.default_rng(3), crossing=True),
        "rings32",
        "rings64",
        box_world.sensor_pose(1.0, 0.5, 1.8, 30.0),
        box_world.sensor_pose(1.3, 0.6, 1.9, -40.0),
    )
    result = hr.register(twice.scene.pair.source.points, twice.scene.pair.target.points)
    assert result.verdict == "ok", result.reasons
    assert views.of(twice.scene).from_one_place(twice.truth)
    assert not views.of(crossing.scene).from_one_place(crossing.truth)
    # Of a map nobody knows where it was seen from.
    unseen = hr.VoxelGrid()(pair.replaced(target=hr.PointCloud.of(pair.target.points, viewpoint="none")))
    assert not views.of(unseen).from_one_place(se3.from_rt(np.eye(3), np.zeros(3)))
