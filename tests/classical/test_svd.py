# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_matches import planted, random_pose

from hybridreg.classical.svd import WeightedSvd
from hybridreg.geometry import se3
from hybridreg.geometry.kabsch import STATUSES, kabsch, kabsch_batch
from hybridreg.matches import Correspondences


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(3, 40), st.sampled_from([0.1, 10.0, 1e4]))
def test_exact_recovery(seed: int, n: int, size: float) -> None:
    rng = np.random.default_rng(seed)
    T, points = random_pose(rng, size), rng.normal(size=(n, 3)) * size
    found, status = kabsch(points, se3.apply(T, points), rng.uniform(0.1, 1.0, n))
    assert status == "ok"
    np.testing.assert_allclose(found[:3, :3], T[:3, :3], atol=1e-7)
    np.testing.assert_allclose(found[:3, 3], T[:3, 3], atol=1e-7 * size)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(3, 12))
def test_always_a_rotation_even_for_mirrored_points(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 3))
    found, _ = kabsch(points, points * [1.0, 1.0, -1.0])
    assert np.linalg.det(found[:3, :3]) == pytest.approx(1.0, abs=1e-9)
    np.testing.assert_allclose(found[:3, :3] @ found[:3, :3].T, np.eye(3), atol=1e-9)


def test_no_other_motion_fits_better(rng: np.random.Generator) -> None:
    p, q, w = rng.normal(size=(30, 3)), rng.normal(size=(30, 3)), rng.uniform(size=30)

    def cost(T: np.ndarray) -> float:
        return float(np.sum(w * np.sum((se3.apply(T, p) - q) ** 2, axis=1)))

    best = kabsch(p, q, w)[0]
    for _ in range(200):
        assert cost(se3.exp(rng.normal(0, 0.02, 6)) @ best) > cost(best)


def test_coplanar_points_are_enough(rng: np.random.Generator) -> None:
    T, points = random_pose(rng), rng.normal(size=(20, 3)) * [5.0, 3.0, 0.0]
    found, status = kabsch(points, se3.apply(T, points))
    assert status == "ok"
    np.testing.assert_allclose(found, T, atol=1e-9)


def test_weights_silence_outliers(rng: np.random.Generator) -> None:
    T, points = random_pose(rng), rng.normal(size=(20, 3))
    target = se3.apply(T, points)
    target[10:] += 7.0
    np.testing.assert_allclose(kabsch(points, target, np.repeat([1.0, 0.0], 10))[0], T, atol=1e-9)


def test_faint_weights_do_not_pull_to_the_origin(rng: np.random.Generator) -> None:
    T, points = random_pose(rng), rng.normal(size=(20, 3)) + 100.0
    np.testing.assert_allclose(kabsch(points, se3.apply(T, points), np.full(20, 1e-5))[0], T, atol=1e-9)


@pytest.mark.parametrize("n", [0, 1, 2])
def test_too_few(n: int, rng: np.random.Generator) -> None:
    T, status = kabsch(rng.normal(size=(n, 3)), rng.normal(size=(n, 3)))
    assert status == "few"
    np.testing.assert_array_equal(T, np.eye(4))


def test_no_weight_at_all(rng: np.random.Generator) -> None:
    T, status = kabsch(rng.normal(size=(5, 3)), rng.normal(size=(5, 3)), np.zeros(5))
    assert status == "few"
    np.testing.assert_array_equal(T, np.eye(4))


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_not_finite(bad: float, rng: np.random.Generator) -> None:
    points = rng.normal(size=(5, 3))
    points[2, 1] = bad
    T, status = kabsch(points, rng.normal(size=(5, 3)))
    assert status == "nan"
    np.testing.assert_array_equal(T, np.eye(4))


def test_a_line_is_degenerate_and_still_fitted(rng: np.random.Generator) -> None:
    T, points = random_pose(rng), np.outer(np.linspace(0, 9, 10), [1.0, 2.0, 0.5])
    found, status = kabsch(points, se3.apply(T, points))
    assert status == "degenerate"
    np.testing.assert_allclose(se3.apply(found, points), se3.apply(T, points), atol=1e-6)


@pytest.mark.parametrize("where", [0.0, 12.3456, 1e4])
def test_one_place_is_degenerate(where: float) -> None:
    points = np.full((10, 3), where)
    T, status = kabsch(points, points + 1.0)
    assert status == "degenerate"
    np.testing.assert_allclose(se3.apply(T, points), points + 1.0, atol=1e-6)


def test_batch_equals_one_by_one(rng: np.random.Generator) -> None:
    source, target, weight = rng.normal(size=(8, 6, 3)), rng.normal(size=(8, 6, 3)), rng.uniform(size=(8, 6))
    source[1] = source[1, :1]
    weight[2] = 0.0
    target[3, 0, 0] = np.nan
    fits = kabsch_batch(source, target, weight)
    assert [STATUSES[s] for s in fits.status] == ["ok", "degenerate", "few", "nan", "ok", "ok", "ok", "ok"]
    for one in range(8):
        np.testing.assert_array_equal(fits.T[one], kabsch(source[one], target[one], weight[one])[0])


def test_an_empty_batch() -> None:
    fits = kabsch_batch(np.zeros((0, 4, 3)), np.zeros((0, 4, 3)))
    assert fits.T.shape == (0, 4, 4)
    assert fits.status.shape == (0,)


def test_stage_finds_the_pose_and_its_inliers(scene, rng: np.random.Generator) -> None:
    matches, T, _ = planted(3, inlier_ratio=1.0)
    pose = WeightedSvd()(scene, matches, rng)
    assert pose.found
    assert pose.inliers is not None
    assert pose.inliers.mean() > 0.99
    np.testing.assert_allclose(pose.T, T, atol=0.02)


def test_stage_says_when_it_knows_nothing(scene, rng: np.random.Generator) -> None:
    pose = WeightedSvd()(scene, Correspondences.none(), rng)
    assert not pose.found
    line = np.outer(np.arange(5.0), [1.0, 0.0, 0.0])
    assert WeightedSvd()(scene, Correspondences.of(line, line), rng).found
    assert any("one line" in note for note in scene.notes)


def test_bad_distance() -> None:
    with pytest.raises(ValueError, match="max_distance=-1"):
        WeightedSvd(max_distance=-1.0)
