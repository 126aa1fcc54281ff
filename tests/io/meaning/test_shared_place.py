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


def _columns(rows: int, columns: int, moving: float) -> tuple[np.ndarray, np.ndarray]:
    """Zeros where nothing came back, and points, each column moved to where the sensor stood: (rows, columns, 3)."""
    rng = np.random.default_rng(7)
    seen = rng.uniform(-9.0, 9.0, (rows, columns, 3))
    up = rng.integers(4, rows // 2, columns)  # so many of each column look into the sky
    missing = np.arange(rows)[:, None] < up
    way = np.linspace(0.0, moving, columns)[:, None] * [1.0, 0.2, 0.01] + [3.0, 0.0, 0.0]
    return np.where(missing[..., None], 0.0, seen) + way, missing


@pytest.mark.parametrize("rows, columns", [(16, 1800), (64, 1024), (128, 2048)])
@pytest.mark.parametrize("kind", ["f8", "f4"])
def test_missing_returns_of_a_moving_sensor_are_told_and_dropped(rows: int, columns: int, kind: str) -> None:
    moved, missing = _columns(rows, columns, 2.0)
    moved = moved.reshape(-1, 3).astype(kind)
    count = int(missing.sum())
    with pytest.warns(UserWarning, match=f"target: {count} of {missing.size} points share their places"):
        PointCloud.of(moved, name="target")
    kept = PointCloud.of(moved, nonfinite="drop")
    assert np.array_equal(kept.points.astype(kind), moved[~missing.ravel()])


def test_zeros_besides_are_told_alone() -> None:
    moved, missing = _columns(64, 1024, 2.0)
    both = np.vstack([moved.reshape(-1, 3), np.zeros((3000, 3))])
    with pytest.warns(UserWarning, match="cloud: ") as told:
        PointCloud.of(both)
    assert [("exactly at (0, 0, 0)" in str(each.message)) for each in told] == [True, False]
    assert f"{int(missing.sum())} of" in str(told[1].message)


@pytest.mark.parametrize(
    "cloud",
    [
        np.round(P * [0.3, 0.3, 0.0] + [0.0, 0.0, 1.0], 1),  # centimetres and coarser near the sensor
        np.round(np.random.default_rng(8).normal(0.0, 0.4, (50_000, 3)), 1),
        np.vstack([P, P]),  # a cloud twice
        np.vstack([P, P[:3000], P[:3000]]),  # and where three strips overlap
    ],
    ids=["flat", "dense", "twice", "thrice"],
)
def test_rounded_and_repeated_points_are_left_alone(cloud: np.ndarray) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PointCloud.of(cloud)
