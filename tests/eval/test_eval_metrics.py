# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.eval.score import metrics
from hybridreg.geometry import se3


def pose(seed: int, reach: float = 10.0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return se3.from_rt(se3.random_rotation(rng), rng.uniform(-reach, reach, 3))


@given(st.integers(0, 10_000), st.floats(0.0, 180.0))
def test_rre_is_the_angle_that_was_put_in(seed: int, angle: float) -> None:
    truth = pose(seed)
    assert metrics.rre_deg(truth @ se3.yaw(angle), truth) == pytest.approx(angle, abs=1e-6)


def test_rre_keeps_its_digits_near_zero() -> None:
    truth = pose(3)
    assert metrics.rre_deg(truth @ se3.yaw(1e-7), truth) == pytest.approx(1e-7, rel=1e-2)


@given(st.integers(0, 10_000), st.tuples(*[st.floats(-50, 50)] * 3))
def test_rte_is_the_shift_that_was_put_in(seed: int, shift: tuple[float, float, float]) -> None:
    truth = pose(seed)
    moved = truth.copy()
    moved[:3, 3] += shift
    assert metrics.rte_m(moved, truth) == pytest.approx(float(np.linalg.norm(shift)), abs=1e-12)


def test_rte_is_taken_at_the_sensor_not_at_the_middle_of_the_cloud() -> None:
    # The same relative error, measured about a point 10 m away, would be another number.
    truth, turn = np.eye(4), se3.yaw(90.0)
    about = se3.from_rt(turn[:3, :3], np.array([10.0, 0, 0]) - turn[:3, :3] @ np.array([10.0, 0, 0]))
    assert metrics.rte_m(about, truth) == pytest.approx(10.0 * np.sqrt(2.0))


def test_inlier_ratio_is_strict_and_zero_without_matches() -> None:
    source = np.zeros((4, 3))
    target = np.array([[0.0, 0, 0], [0.999, 0, 0], [1.0, 0, 0], [5.0, 0, 0]])
    assert metrics.inlier_ratio(source, target, np.eye(4), 1.0) == 0.5
    assert metrics.inlier_ratio(np.zeros((0, 3)), np.zeros((0, 3)), np.eye(4), 1.0) == 0.0


@given(st.integers(0, 10_000), st.integers(0, 10_000))
def test_rmse_of_moments_is_the_rmse_of_the_points(a: int, b: int) -> None:
    points = np.random.default_rng(a).uniform(-30, 30, (50, 3))
    T, truth = pose(a), pose(b)
    apart = np.linalg.norm(se3.apply(T, points) - se3.apply(truth, points), axis=1)
    expected = float(np.sqrt(np.mean(apart**2)))
    assert metrics.rmse_m(T, truth, metrics.second_moments(points)) == pytest.approx(expected, abs=1e-6)


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=40))
def test_mask_scores_against_counting(cells: list[tuple[bool, bool]]) -> None:
    predicted, truth = (np.array(column) for column in zip(*cells, strict=True))
    scores = metrics.mask_scores(predicted, truth)
    both = sum(p and t for p, t in cells)
    either = sum(p or t for p, t in cells)
    assert scores.iou == pytest.approx(both / either if either else 0.0)
    assert scores.precision == pytest.approx(both / predicted.sum() if predicted.any() else 0.0)
    assert scores.recall == pytest.approx(both / truth.sum() if truth.any() else 0.0)
    if scores.precision + scores.recall:
        harmonic = 2 * scores.precision * scores.recall / (scores.precision + scores.recall)
        assert scores.f1 == pytest.approx(harmonic)
