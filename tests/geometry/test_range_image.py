# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from hybridreg.data.hard import box_world
from hybridreg.geometry import se3
from hybridreg.geometry.range_image import RangeImage, Seen, angular_resolution

Array = NDArray[np.float64]
SENSORS = ["rings16", "rings32", "rings64", "hemisphere", "rosette", "raster"]


def wall(sensor: str = "rings64", tilt_deg: float = 0.0) -> tuple[RangeImage, Array]:
    """Image of a wall 10 m ahead (4 m high, 20 m wide) on open ground, and the pose T_world_sensor."""
    world = box_world.World()
    world.box(10.5, 0, (1.0, 20.0, 4.0))
    pose = box_world.sensor_pose(0, 0, 1.5, 0, tilt_deg)
    return RangeImage.of(box_world.scan(world, sensor, pose, np.random.default_rng(0)), np.zeros(3)), pose


def look(image: RangeImage, pose: Array, x: float, y: float = 0.0, z: float = 1.5) -> int:
    """State of a place given in the world, on a surface that faces the sensor."""
    place = se3.apply(se3.inverse(pose), np.array([[x, y, z]]))
    return int(image.look(place, -place / np.linalg.norm(place), margin=0.3)[0])


@pytest.mark.parametrize("sensor", SENSORS)
def test_seen_free_hidden_for_any_sensor(sensor: str) -> None:
    image, pose = wall(sensor)
    assert look(image, pose, 10.0) == Seen.SEEN
    assert look(image, pose, 6.0) == Seen.FREE
    assert look(image, pose, 14.0) == Seen.HIDDEN


@pytest.mark.parametrize("tilt_deg", [180.0, 90.0, 30.0, -45.0])
def test_orientation_of_the_sensor_does_not_matter(tilt_deg: float) -> None:
    image, pose = wall("rings64", tilt_deg)
    # A place that every tilt keeps in view: on the axis about which the sensor is turned.
    assert look(image, pose, 10.0) == Seen.SEEN
    assert look(image, pose, 5.0) == Seen.FREE
    assert look(image, pose, 20.0) == Seen.HIDDEN


def test_outside_the_field_of_view_and_in_the_open_sky_nothing_is_known() -> None:
    image, pose = wall("raster")
    assert look(image, pose, -5.0) == Seen.UNSEEN
    assert look(image, pose, 10.0, z=9.0) == Seen.UNSEEN


@pytest.mark.parametrize(("rings", "gap_deg"), [("rings16", 2.0), ("rings32", 40 / 31), ("rings64", 28 / 63)])
def test_resolution_is_that_of_the_rings_not_of_the_steps_along_them(rings: str, gap_deg: float) -> None:
    found = np.degrees(angular_resolution(box_world.rays(rings, 1.0, np.random.default_rng(0))))
    assert gap_deg / 1.5 < found < 2.0 * gap_deg


def test_gaps_between_rings_are_no_holes() -> None:
    image, pose = wall("rings16")
    heights = np.linspace(0.6, 3.4, 60)
    states = [look(image, pose, 6.0, z=1.5 + (z - 1.5) * 0.6) for z in heights]
    assert np.mean(np.array(states) == Seen.FREE) > 0.95


def test_both_sides_of_an_edge_are_kept() -> None:
    # Two surfaces in one direction's cell: a post before a wall.
    angle = np.radians(np.linspace(-1.0, 1.0, 21))
    directions = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(21)])
    ranges = np.where(np.arange(21) % 2, 5.0, 20.0)
    image = RangeImage.of(directions * ranges[:, None], np.zeros(3))
    states = image.look(np.array([[5.0, 0, 0], [20.0, 0, 0], [12.0, 0, 0]]), margin=0.2)
    assert states.tolist() == [Seen.SEEN, Seen.SEEN, Seen.HIDDEN]


def test_a_ray_beside_a_narrow_thing_does_not_deny_it() -> None:
    image, pose = wall("rings16")
    place = se3.apply(se3.inverse(pose), np.array([[8.0, 0.3, 1.62]]))
    nearest = image.tree.query(place[0] / np.linalg.norm(place))[0] * np.linalg.norm(place)
    assert image.look(place, margin=0.1, reach=2.0 * nearest)[0] == Seen.FREE
    assert image.look(place, margin=0.1, reach=0.5 * nearest)[0] == Seen.UNSEEN


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_cloud_hardly_contradicts_itself(sensor: str) -> None:
    points = box_world.scan(
        box_world.street(np.random.default_rng(2)),
        sensor,
        box_world.sensor_pose(0, 0, 1.8, 20),
        np.random.default_rng(0),
    )
    states = RangeImage.of(points, np.zeros(3)).look(points, margin=0.3)
    assert np.mean(states == Seen.SEEN) > 0.9
    assert np.mean(states == Seen.FREE) < 0.01


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1))
def test_turning_cloud_and_question_together_changes_little(seed: int) -> None:
    image, _ = wall("rosette")
    R = se3.random_rotation(np.random.default_rng(seed))
    points = image.directions * image.ranges[:, None]
    turned = RangeImage.of(points @ R.T, np.zeros(3))
    questions = np.random.default_rng(0).uniform([2, -8, -1], [18, 8, 3], (300, 3))
    same = image.look(questions, margin=0.3) == turned.look(questions @ R.T, margin=0.3)
    assert same.mean() > 0.85


def test_a_ray_that_grazes_the_ground_does_not_look_through_it() -> None:
    # A ring on the ground at 20 m from 1.8 m up, and a place 3 m before it: the ray passes 27 cm above.
    ring = [[20.0 * np.cos(a), 20.0 * np.sin(a), -1.8] for a in np.radians(np.arange(-5.0, 5.0, 0.1))]
    image = RangeImage.of(np.array(ring), np.zeros(3))
    place = np.array([[17.0, 0.0, -1.8]])
    up, towards = np.array([[0.0, 0.0, 1.0]]), np.array([[-1.0, 0.0, 0.0]])
    assert image.look(place, up, margin=0.05, reach=0.5)[0] == Seen.UNSEEN
    assert image.look(place, towards, margin=0.05, reach=0.5)[0] == Seen.FREE


def test_all_points_at_the_viewpoint_are_refused() -> None:
    with pytest.raises(ValueError, match="every point lies at the viewpoint"):
        RangeImage.of(np.zeros((30, 3)), np.zeros(3))
