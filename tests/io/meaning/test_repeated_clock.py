# SPDX-License-Identifier: MIT
"""A time before the points that begins anew with each sweep or ring; x of grids, slices and walls rises so too."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from hybridreg.cloud import PointCloud
from hybridreg.io.meaning.repeated_clock import rises_again

RNG = np.random.default_rng(2)
SWEEP = np.linspace(0.0, 0.1, 1000)
AROUND = np.stack(
    [7.0 * np.cos(63.0 * SWEEP), 5.0 * np.sin(63.0 * SWEEP), RNG.uniform(-1.0, 2.0, 1000)], axis=1
)

TIMES = {
    "two sweeps": SWEEP,
    "milliseconds": SWEEP * 1e3,
    "before the stamp": SWEEP - 0.1,
    "seconds of a week": SWEEP + 345_600.0,
}


@pytest.mark.parametrize("sweeps", [2, 5, 64])
@pytest.mark.parametrize("time", TIMES)
def test_a_time_that_begins_anew_is_told(time: str, sweeps: int) -> None:
    table = np.c_[
        np.tile(TIMES[time], sweeps), np.tile(AROUND, (sweeps, 1)) + RNG.normal(0.0, 0.02, (1000 * sweeps, 3))
    ]
    with pytest.warns(UserWarning, match=r"first column was read as x, and .* again"):
        PointCloud.of(table)
    with pytest.warns(UserWarning, match=r"first column was read as x, and .* again"):
        PointCloud.of(table[np.sort(RNG.permutation(len(table))[: len(table) * 7 // 10])])


def test_in_text_too(tmp_path: Path) -> None:
    table = np.c_[np.tile(SWEEP, 64), np.tile(AROUND, (64, 1)) + RNG.normal(0.0, 0.02, (64_000, 3))]
    np.savetxt(tmp_path / "a.txt", table, fmt="%.6f")
    with pytest.warns(UserWarning, match="rises evenly again and again, .* such as: id x y z"):
        PointCloud.of(tmp_path / "a.txt")


def _grid(order: str) -> np.ndarray:
    x, y, z = np.meshgrid(*[np.arange(20.0)] * 3, indexing=order)
    return np.stack([each.ravel() for each in (x, y, z, np.sin(x + y * z))], axis=1)


def _wall(turn: float) -> np.ndarray:
    # An organised scan of a wall, in a map whose corner is the origin.
    u, v = np.meshgrid(np.linspace(0.0, 4.0, 200), np.linspace(0.0, 3.0, 60))
    points = np.stack([u * np.cos(turn), u * np.sin(turn), v, np.sin(9.0 * u * v)], axis=-1).reshape(-1, 4)
    return points + RNG.normal(0.0, 1e-3, points.shape) + [9.0, 9.0, 0.0, 0.0]


def test_an_x_is_no_clock() -> None:
    slices = RNG.uniform(0.0, 4.0, (8000, 4))
    slices = slices[np.lexsort((slices[:, 0], np.floor(slices[:, 2] * 5)))]
    strips = slices[np.lexsort((slices[:, 0], np.floor(slices[:, 1] * 5)))]
    turning = np.c_[9.0 + np.tile(AROUND, (8, 1)), RNG.uniform(size=8000)]
    for table in (_grid("ij"), _grid("xy"), _wall(0.0), _wall(0.5), slices, strips, turning):
        rows = np.arange(len(table))
        assert not rises_again(table, rows)
        assert not rises_again(table[::-1], rows)


def test_names_end_the_doubt() -> None:
    table = dict(zip("txyz", np.c_[np.tile(SWEEP, 2), np.tile(AROUND, (2, 1))].T, strict=True))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PointCloud.of(table)
