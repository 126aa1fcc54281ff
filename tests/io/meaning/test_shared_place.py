# SPDX-License-Identifier: MIT
"""Missing returns that a pose moved with the others lie at one place, no longer at the origin."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hybridreg.cloud import PointCloud

P = np.random.default_rng(4).uniform(-9.0, 9.0, (20_000, 3))
HOLES = np.random.default_rng(5).uniform(size=len(P)) < 0.05


@pytest.mark.parametrize("kind", ["f8", "f4"])
@pytest.mark.parametrize("t", [(10.0, 20.0, 3.0), (0.0, 0.0, 1.73), (450_000.5, 5_400_000.25, 500.0)])
def test_moved_zeros_are_told_and_dropped(t: tuple[float, float, float], kind: str) -> None:
    seen = np.where(HOLES[:, None], 0.0, P)
    moved = (Rotation.from_euler("z", 0.3).apply(seen) + t).astype(kind)
    count = int(HOLES.sum())
    with pytest.warns(
        UserWarning, match=f"target: {count} of 20000 points lie exactly at .* moved with the others"
    ):
        PointCloud.of(moved, name="target")
    assert len(PointCloud.of(moved, nonfinite="drop")) == len(P) - count


def test_zeros_and_a_padded_end() -> None:
    both = np.vstack([P[:1000], np.zeros((100, 3)), np.tile(P[999], (500, 1))])
    with pytest.warns(UserWarning, match="exactly at") as told:
        PointCloud.of(both)
    assert len(told) == 2
    assert "exactly at (0, 0, 0), which drivers" in str(told[0].message)
    assert len(PointCloud.of(both, nonfinite="drop")) == 999


def test_points_that_repeat_here_and_there_are_left_alone() -> None:
    cells = np.round(P[:4000] * 0.5)  # some 60 places an axis would be fewer than the points
    twice = np.vstack([P, P])  # two returns of each pulse
    post = np.c_[np.zeros((500, 2)), np.linspace(0.0, 2.0, 500)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for cloud in (cells, twice, np.vstack([P[:500], post]), np.vstack([P, np.tile(P[0], (150, 1))])):
            assert len(PointCloud.of(cloud, nonfinite="drop")) == len(cloud)
            PointCloud.of(cloud)
