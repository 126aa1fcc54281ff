# SPDX-License-Identifier: MIT
"""Matching anew near a pose that is nearly right."""

from __future__ import annotations

import numpy as np
import pytest

from hybridreg.geometry import se3
from hybridreg.learned.matching.guided_matching import guided_pose
from hybridreg.matches import Described

SPACING = 0.8
RADII = SPACING * np.geomspace(4.0, 1.0, 8)
TRUE = se3.from_rt(se3.rotation_about(np.array([0.02, -0.03, 0.9])), np.array([3.0, -2.0, 0.4]))


def seen(seed: int, T: np.ndarray, noise: float = 0.1) -> Described:
    """A sensor's own sample of one surface, each point with the features of its place, in the frame that T maps to."""
    rng = np.random.default_rng(seed)
    flat = rng.uniform(-15.0, 15.0, (1500, 2))
    points = np.column_stack([flat, 2.0 * np.sin(0.3 * flat[:, 0]) * np.cos(0.25 * flat[:, 1])])
    waves = np.random.default_rng(99).normal(0.0, 0.4, (3, 32))
    features = np.cos(points @ waves + np.arange(32)) + rng.normal(0.0, noise, (len(points), 32))
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    return Described(se3.apply(T, points), features.astype(np.float32))


def off_by(T: np.ndarray, metres: float, degrees: float, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    axis, step = (v / np.linalg.norm(v) for v in rng.normal(size=(2, 3)))
    return se3.from_rt(se3.rotation_about(np.radians(degrees) * axis), metres * step) @ T


@pytest.mark.parametrize("seed", range(5))
def test_a_pose_that_is_nearly_right_is_made_right(seed: int) -> None:
    source, target = seen(2 * seed, np.eye(4)), seen(2 * seed + 1, TRUE)
    start = off_by(TRUE, 1.5, 5.0, seed)
    found = guided_pose(start, source, target, RADII)
    step = found @ se3.inverse(TRUE)
    middle = se3.apply(TRUE, np.zeros((1, 3)))[0]
    assert np.linalg.norm(se3.apply(step, middle[None])[0] - middle) < 0.1
    assert se3.angle_deg(step[:3, :3]) < 0.5


def test_a_right_pose_stays() -> None:
    source, target = seen(20, np.eye(4)), seen(21, TRUE)
    step = guided_pose(TRUE, source, target, RADII) @ se3.inverse(TRUE)
    assert se3.angle_deg(step[:3, :3]) < 0.3


def test_where_nothing_is_near_the_pose_stays_as_it_is() -> None:
    source, target = seen(30, np.eye(4)), seen(31, TRUE)
    away = off_by(TRUE, 500.0, 0.0, 0)
    assert np.array_equal(guided_pose(away, source, target, RADII), away)


@pytest.mark.parametrize("points", [0, 1, 3])
def test_a_few_points_move_nothing(points: int) -> None:
    source, target = seen(40, np.eye(4)), seen(41, TRUE)
    few = Described(source.points[:points], source.features[:points])
    assert np.isfinite(guided_pose(TRUE, few, few, RADII)).all()
    assert np.isfinite(guided_pose(TRUE, few, target, RADII)).all()


def test_features_decide_not_distance() -> None:
    """Features of other places must not move the pose to where the right ones do."""
    source, target = seen(50, np.eye(4)), seen(51, TRUE)
    start = off_by(TRUE, 1.5, 5.0, 1)
    shuffled = Described(target.points, np.random.default_rng(0).permutation(target.features))
    right, wrong = (guided_pose(start, source, other, RADII) for other in (target, shuffled))
    middle = np.zeros((1, 3))
    there = se3.apply(TRUE, middle)
    errors = [np.linalg.norm(se3.apply(T, middle) - there) for T in (right, wrong)]
    assert errors[0] < 0.1
    assert errors[1] > 0.5
