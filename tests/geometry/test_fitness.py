# SPDX-License-Identifier: MIT
"""Fitness is measured when it is asked for; points of large clouds are asked for in another order."""

from __future__ import annotations

import numpy as np
import pytest

from hybridreg.geometry import fitness


@pytest.mark.parametrize("spread", [10.0, 1e9])
@pytest.mark.parametrize("max_distance", [0.3, 1e-6])
def test_the_order_of_the_questions_changes_no_answer(
    monkeypatch: pytest.MonkeyPatch, spread: float, max_distance: float
) -> None:
    rng = np.random.default_rng(0)
    target = rng.uniform(-10.0, 10.0, (3000, 3))
    source = np.concatenate([target[:500] + 1e-7, rng.uniform(-spread, spread, (1000, 3))])
    T = np.eye(4)
    T[0, 3] = 1e-7
    plain = fitness.measure(source, target, T, max_distance)
    monkeypatch.setattr(fitness, "_MANY", 1)
    ordered = fitness.measure(source, target, T, max_distance)
    assert plain.fitness == ordered.fitness >= 0.3
    assert plain.inlier_rmse == ordered.inlier_rmse
    assert np.array_equal(plain.correspondence_set, ordered.correspondence_set)


def test_it_is_measured_both_ways_once_and_not_before_it_is_asked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = []
    measure = fitness.measure
    monkeypatch.setattr(fitness, "measure", lambda *given: calls.append(given) or measure(*given))
    source, target = np.array([[0.0, 0.0, 0.0], [5.0, 5.0, 5.0]]), np.array([[1.0, 0.0, 0.0]])
    T = np.eye(4)
    T[0, 3] = 0.9
    overlay = fitness.Overlay(source, target, T, 0.2)
    assert not calls
    assert overlay.of_source.fitness == 0.5
    assert overlay.of_source.inlier_rmse == pytest.approx(0.1)
    assert overlay.of_source.correspondence_set.tolist() == [[0, 0]]
    assert overlay.of_target.fitness == 1.0
    assert len(calls) == 2
