# SPDX-License-Identifier: MIT
"""Which frames become pairs."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.data.lists.frame_pairs import WINDOW, kitti_pairs, pairs_across


def positions(seed: int, n: int, step: float) -> np.ndarray:
    """A wandering way that also stands still."""
    rng = np.random.default_rng(seed)
    heading = np.cumsum(rng.normal(0, 0.1, n))
    speed = step * rng.uniform(0, 2, n) * (rng.random(n) > 0.2)
    return np.cumsum(
        np.column_stack([np.cos(heading), np.sin(heading), 0 * heading]) * speed[:, None], axis=0
    )


def pairs_by_hand(places: np.ndarray, distance: float) -> list[tuple[int, int]]:
    """The field's rule, frame by frame."""
    pairs, now = [], 0
    while now < len(places):
        first = None
        for later in range(now, min(now + 100, len(places))):
            if np.linalg.norm(places[later] - places[now]) > distance:
                first = later
                break
        if first is None:
            now += 1
        else:
            if first - 1 > now:
                pairs.append((now, first - 1))
            now = first
    return pairs


@given(seed=st.integers(0, 10_000), n=st.integers(1, 250), step=st.sampled_from([0.05, 0.3, 0.9, 4.0]))
def test_kitti_pairs_are_those_of_the_rule(seed: int, n: int, step: float) -> None:
    places = positions(seed, n, step)
    assert kitti_pairs(places) == pairs_by_hand(places, 10.0)


def test_kitti_pairs_lie_just_within_ten_metres() -> None:
    places = np.column_stack([np.arange(0, 100, 0.9), np.zeros(112), np.zeros(112)])
    pairs = kitti_pairs(places)
    assert pairs[:2] == [(0, 11), (12, 23)]
    assert all(9.0 < np.linalg.norm(places[i] - places[j]) <= 10.0 for i, j in pairs)


def test_a_jump_leaves_a_frame_alone() -> None:
    assert kitti_pairs(np.array([[0.0, 0, 0], [50, 0, 0], [55, 0, 0], [62, 0, 0]])) == [(1, 2)]


@given(seed=st.integers(0, 10_000), min_dist=st.sampled_from([0.0, 2.0, 10.0]), gap=st.integers(2, 9))
def test_pairs_across_are_as_near_as_the_rule_lets_them(seed: int, min_dist: float, gap: int) -> None:
    source = positions(seed, 120, 0.8)
    target = source + np.array([0.3, -0.2, 0.1])
    there = [n for n in range(120) if n % gap]  # some clouds of the target are not there
    pairs = pairs_across(source, target, range(120), there, min_dist)
    for i, j in pairs:
        assert i <= j < i + WINDOW
        assert j in there
        assert np.linalg.norm(target[j] - source[i]) >= min_dist
        nearer = [k for k in there if i <= k < j]
        assert all(np.linalg.norm(target[k] - source[i]) < min_dist for k in nearer)
    assert all(i < k and j <= k for (i, j), (k, _) in pairwise(pairs))


def test_pairs_across_of_one_frame() -> None:
    places = np.column_stack([np.arange(5.0), np.zeros(5), np.zeros(5)])
    assert pairs_across(places, places, range(5), [0, 2, 3], 0.0)[0] == (0, 0)
    assert pairs_across(places, places, range(5), range(5), 0.0) == [(k, k) for k in range(5)]


def test_no_pairs_of_a_sensor_that_stands() -> None:
    still = np.zeros((50, 3))
    assert kitti_pairs(still) == []
    assert pairs_across(still, still, range(50), range(50), 1.0) == []
