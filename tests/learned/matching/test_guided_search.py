# SPDX-License-Identifier: MIT
"""One pose out of several starts: votes of upright clouds, and the support of all similar points."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from hybridreg.geometry import se3
from hybridreg.learned.matching.guided_search import search
from hybridreg.learned.matching.similar_points import SimilarPoints, similar_points
from hybridreg.learned.matching.upright_votes import upright_poses
from hybridreg.matches import Described

SPACING = 2.0
NO_START = np.empty((0, 4, 4))


def pose(yaw_deg: float, shift: tuple[float, float, float], lean_deg: float = 0.0) -> np.ndarray:
    lean = se3.rotation_about(np.radians([lean_deg, 0.0, 0.0]))
    return se3.from_rt(lean @ se3.yaw(yaw_deg)[:3, :3], np.array(shift))


def seen(seed: int, T: np.ndarray, right: float = 1.0) -> Described:
    """A sensor's own sample of one scene; all but a share `right` of its features are those of other places."""
    rng = np.random.default_rng(seed)
    points = rng.uniform([-25.0, -25.0, -1.0], [25.0, 25.0, 3.0], (1200, 3))
    waves = np.random.default_rng(99).normal(0.0, 0.35, (3, 32))
    features = np.cos(points @ waves + np.arange(32))
    wrong = rng.random(len(points)) > right
    features[wrong] = rng.permutation(features[wrong])
    features /= np.linalg.norm(features, axis=1, keepdims=True)
    return Described(se3.apply(T, points), features.astype(np.float32))


def off(found: np.ndarray, T: np.ndarray) -> float:
    """By how much the pose moves points of the scene wrongly at most, metres."""
    corners = np.array([[x, y, z] for x in (-25.0, 25.0) for y in (-25.0, 25.0) for z in (-1.0, 3.0)])
    return float(np.linalg.norm(se3.apply(found, corners) - se3.apply(T, corners), axis=1).max())


@pytest.mark.parametrize("yaw", [0.0, 61.0, 179.5, 271.0])
def test_upright_clouds_need_no_start(yaw: float) -> None:
    T = pose(yaw, (14.0, -9.0, 0.7), lean_deg=2.0)
    found = search(NO_START, seen(1, np.eye(4), right=0.4), seen(2, T, right=0.4), SPACING)
    assert found is not None
    assert off(found, T) < 0.5


def test_a_start_that_more_similar_points_support_goes_on() -> None:
    """Turned over, no upright pose is right: the start is, and the wrong ones beside it must not win."""
    over = se3.from_rt(se3.rotation_about(np.array([np.pi, 0.0, 0.0])), np.array([2.0, 1.0, 4.0]))
    source, target = seen(3, np.eye(4)), seen(4, over)
    near = se3.from_rt(np.eye(3), np.array([0.8, -0.5, 0.3])) @ over
    found = search(np.array([pose(40.0, (5.0, 5.0, 0.0)), near]), source, target, SPACING)
    assert found is not None
    assert off(found, over) < 0.3


def test_a_wrong_start_does_no_harm() -> None:
    T = pose(120.0, (-6.0, 11.0, -0.4))
    found = search(pose(300.0, (20.0, 0.0, 0.0))[None], seen(5, np.eye(4)), seen(6, T), SPACING)
    assert found is not None
    assert off(found, T) < 0.3


def test_the_result_does_not_depend_on_the_unit() -> None:
    T = pose(75.0, (8.0, -3.0, 0.5))
    source, target = seen(7, np.eye(4)), seen(8, T)
    scale = 1e-3
    small = search(
        NO_START,
        Described(source.points * scale, source.features),
        Described(target.points * scale, target.features),
        SPACING * scale,
    )
    large = search(NO_START, source, target, SPACING)
    assert small is not None
    assert large is not None
    assert np.allclose(small[:3, :3], large[:3, :3], atol=1e-6)
    assert np.allclose(small[:3, 3], large[:3, 3] * scale, atol=1e-9)


@pytest.mark.parametrize("counts", [(0, 5), (5, 0), (1, 1), (2, 40)])
def test_clouds_of_few_points_give_a_finite_pose_or_none(counts: tuple[int, int]) -> None:
    clouds = [seen(9 + i, np.eye(4)) for i in range(2)]
    few = [Described(c.points[:n], c.features[:n]) for c, n in zip(clouds, counts, strict=True)]
    found = search(NO_START, few[0], few[1], SPACING)
    assert found is None or np.isfinite(found).all()


def test_a_match_that_is_alone_weighs_one_and_one_of_two_weighs_less() -> None:
    axes = np.eye(4, dtype=np.float32)
    points = np.arange(12.0).reshape(4, 3)
    alone = similar_points(Described(points, axes), Described(points, axes))
    same = (alone.source == alone.target).all(axis=1)
    assert np.allclose(alone.weight[same], 1.0, atol=1e-6)
    assert alone.weight[~same].max() < 1e-6
    twice = similar_points(Described(points[:1], axes[:1]), Described(points[:2], axes[[0, 0]]))
    assert np.allclose(twice.weight, np.sqrt(0.5))


def test_support_falls_with_the_distance_and_ends_at_the_radius() -> None:
    one = SimilarPoints(np.zeros((1, 3)), np.array([[0.5, 0.0, 0.0]]), np.array([0.8]))
    assert np.isclose(one.support(np.eye(4), 1.0), 0.8 * 0.75)
    assert one.support(np.eye(4), 0.5) == 0.0


def test_peaks_of_the_votes_are_poses_apart_best_first() -> None:
    T, other = pose(30.0, (4.0, 2.0, 0.2)), pose(200.0, (-8.0, 5.0, 0.2))
    points = np.random.default_rng(12).uniform(-20.0, 20.0, (300, 3)) * [1.0, 1.0, 0.1]
    target = np.concatenate([se3.apply(T, points[:200]), se3.apply(other, points[200:])])
    found = upright_poses(SimilarPoints(points, target, np.ones(300)), SPACING, 2)
    for T_found, T_made in zip(found, (T, other), strict=True):
        assert off(T_found, T_made) < 4.0


def test_a_stray_point_costs_no_memory_and_a_far_frame_no_pose() -> None:
    T, far = pose(30.0, (4.0, 2.0, 0.2)), np.array([5.0e5, 4.0e6, 300.0])
    source = np.random.default_rng(13).uniform(-20.0, 20.0, (300, 3)) * [1.0, 1.0, 0.1]
    target = se3.apply(T, source) + far
    source[0] += [0.0, 3.0e5, 0.0]
    pairs = SimilarPoints(source, target, np.ones(300))
    tracemalloc.start()
    found = upright_poses(pairs, SPACING, 1)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert off(se3.from_rt(np.eye(3), -far) @ found[0], T) < 4.0
    assert peak < 50e6
