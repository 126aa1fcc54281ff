# SPDX-License-Identifier: MIT
"""Two corners of a bare room look alike: a pose that lays one on the other is never "ok"."""

from __future__ import annotations

import numpy as np
import pytest
from made_places import Made

import hybridreg as hr
from hybridreg.data.hard import box_world
from hybridreg.evidence import views
from hybridreg.evidence.corner import bare_corner
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3


def room(furniture: int, seed: int = 0) -> box_world.World:
    """Four walls and a ceiling, 5.6 by 5.2 by 2.6 m, with boxes along the walls."""
    world, rng = box_world.World(ceiling=2.6), np.random.default_rng(seed)
    for x, y, size in (
        (2.85, 0.0, (0.1, 5.4, 2.6)),
        (-2.85, 0.0, (0.1, 5.4, 2.6)),
        (0.0, 2.65, (5.8, 0.1, 2.6)),
        (0.0, -2.65, (5.8, 0.1, 2.6)),
    ):
        world.box(x, y, size)
    for _ in range(furniture):
        x, y = rng.uniform(0.6, 2.4), rng.uniform(0.6, 2.2)
        world.box(x, y, tuple(rng.uniform(0.2, 0.8, 3)), rng.uniform(0.0, 3.0))
    return world


def looks(apart_deg: float, furniture: int = 0, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Source, target and the true pose of two cameras of 70 degrees that look so far apart, level."""
    world, rng = room(furniture, seed), np.random.default_rng(1)
    frames = [
        box_world.sensor_pose(-0.8, -0.5, 1.4, 45.0),
        box_world.sensor_pose(0.3, -0.3, 1.3, 45.0 + apart_deg),
    ]
    clouds = [box_world.scan(world, "rosette", frame, rng) for frame in frames]
    return clouds[0], clouds[1], se3.inverse(frames[1]) @ frames[0]


def is_right(T: np.ndarray, truth: np.ndarray) -> bool:
    off = se3.inverse(truth) @ T
    return se3.angle_deg(off[:3, :3]) < 2.0 and np.linalg.norm(off[:3, 3]) < 0.15


@pytest.mark.parametrize("apart_deg", [52.0, 90.0, 97.0])
def test_one_corner_laid_on_another_is_not_ok(apart_deg: float) -> None:
    source, target, truth = looks(apart_deg)
    result = hr.register(source, target)
    assert result.verdict != "ok" or is_right(result.transformation, truth)


def test_one_bare_corner_is_told_and_a_start_settles_it() -> None:
    source, target, truth = looks(10.0)
    result = hr.register(source, target)
    assert result.verdict == "doubtful"
    assert "other corners look alike" in " ".join(result.reasons)
    started = hr.register(source, target, init=truth, max_rotation=45)
    assert started.verdict == "ok"
    assert is_right(started.transformation, truth)


def test_what_stands_in_the_corner_settles_it() -> None:
    source, target, truth = looks(10.0, furniture=6)
    result = hr.register(source, target)
    assert is_right(result.transformation, truth)
    assert result.verdict == "ok"


def test_a_room_seen_all_around_and_a_street_are_no_corner(crossing: Made, corridor: Made, fan: Made) -> None:
    for made in (crossing, corridor, fan):
        assert not bare_corner(PoseEvidence(views.of(made.scene), made.truth))
