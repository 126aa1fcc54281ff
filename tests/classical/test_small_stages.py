# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

import hybridreg as hr


def test_random_sample_draws_from_seed_and_pair(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair = courtyard[0]
    one, again, other = (hr.RandomSample(n_points=500, seed=s)(pair).source.points for s in (0, 0, 1))
    assert one.shape == (500, 3)
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)
    rows = {tuple(p) for p in pair.source.points}
    assert all(tuple(p) in rows for p in one)


def test_random_sample_keeps_a_small_cloud_whole(courtyard: tuple[hr.Pair, np.ndarray]) -> None:
    pair = courtyard[0]
    assert len(hr.RandomSample(n_points=10**6)(pair).target) == len(pair.target)


def test_all_points_measures_the_spacing() -> None:
    grid = np.stack(np.meshgrid(*[np.arange(6.0)] * 3), axis=-1).reshape(-1, 3) * 0.5
    scene = hr.AllPoints()(hr.Pair.of(grid, grid))
    assert scene.spacing == pytest.approx(0.5)
    assert np.array_equal(scene.source.points, grid)
