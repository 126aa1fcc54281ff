# SPDX-License-Identifier: MIT
"""One thing on flat ground, seen from opposite sides: the pose that lays its back on its front is never "ok"."""

from __future__ import annotations

import numpy as np
import pytest
from made_places import Made, make

import hybridreg as hr
from hybridreg.data.hard import box_world
from hybridreg.evidence import views
from hybridreg.evidence.lone_thing import opposite
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Pose
from hybridreg.verdict import judge


def house(posts: int = 0) -> box_world.World:
    """A porch on either side, and posts about it."""
    world, rng = box_world.World(), np.random.default_rng(4)
    world.box(0.0, 0.0, (10.0, 7.0, 3.0))
    world.box(0.0, 0.0, (6.0, 5.0, 5.0))
    world.box(-2.0, -4.0, (2.0, 1.5, 2.2))
    world.box(2.5, 4.0, (2.0, 1.5, 2.2))
    for angle in rng.uniform(0.0, 2.0 * np.pi, posts):
        world.posts.append((9.0 * np.cos(angle), 9.0 * np.sin(angle), 0.1, 1.2))
    return world


def scanned(world: box_world.World, around_deg: float) -> Made:
    """From 16 m aside, and from as far after a turn about the thing."""
    places = [se3.yaw(deg)[:3, :3] @ [0.0, -16.0, 0.0] for deg in (around_deg, 0.0)]
    source, target = (box_world.sensor_pose(x, y, 1.8, 70.0) for x, y, _ in places)
    return make(world, "rings64", "rings64", source, target)


@pytest.mark.parametrize(("posts", "around_deg"), [(0, 165.0), (4, 180.0)])
def test_its_back_laid_on_its_front_is_not_ok(posts: int, around_deg: float) -> None:
    made = scanned(house(posts), around_deg)
    pair = made.scene.pair
    result = hr.register(pair.source.points, pair.target.points)
    assert result.verdict != "ok"


def test_nor_where_it_fills_most_of_the_view() -> None:
    pair = scanned(house(), 172.0).scene.pair
    # Turned until it lies ahead: it fills some 17 degrees to either side, of 23.
    ahead = (se3.apply(se3.yaw(-192.0), pair.source.points), se3.apply(se3.yaw(-20.0), pair.target.points))
    result = hr.register(*(cloud[np.abs(np.arctan2(cloud[:, 1], cloud[:, 0])) < 0.4] for cloud in ahead))
    assert result.verdict != "ok"


def test_the_reason_says_so_and_a_start_settles_it() -> None:
    made = scanned(house(), 8.0)
    pair = made.scene.pair
    result = hr.register(pair.source.points, pair.target.points)
    assert result.verdict == "doubtful"
    assert "from behind it may look alike" in " ".join(result.reasons)
    started = hr.register(pair.source.points, pair.target.points, init=made.truth, max_rotation=90)
    assert started.verdict == "ok"
    assert "alike" not in " ".join(started.reasons)


def test_two_sides_and_things_all_around_are_told_apart(crossing: Made, fan: Made) -> None:
    apart = scanned(house(), 50.0)
    for made in (crossing, fan, apart):
        assert opposite(made.scene, PoseEvidence(views.of(made.scene), made.truth)) is None
    beside = scanned(house(), 10.0)
    turned = opposite(beside.scene, PoseEvidence(views.of(beside.scene), beside.truth))
    assert turned is not None
    assert se3.angle_deg(turned[:3, :3] @ beside.truth[:3, :3].T) == pytest.approx(180.0)
    assert judge(crossing.scene, Pose(crossing.truth), Correspondences.none()).verdict == "ok"
