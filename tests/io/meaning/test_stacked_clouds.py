# SPDX-License-Identifier: MIT
"""Batches of clouds, (B, N, 3) and (B, 3, N), are not one cloud; organised scans are."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

from hybridreg.cloud import PointCloud

BATCH = np.random.default_rng(5).uniform(-1.0, 1.0, (16, 256, 3))


def _scan() -> Any:
    """32 rings of 256 columns, some returns missing, as drivers make them."""
    rng = np.random.default_rng(5)
    up, around = np.meshgrid(np.linspace(-0.3, 0.3, 32), np.linspace(-np.pi, np.pi, 256), indexing="ij")
    far = 8.0 + 3.0 * np.cos(4.0 * around) + rng.normal(0.0, 0.02, up.shape)
    far[rng.uniform(size=up.shape) < 0.2] = 0.0
    return (
        np.stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)], axis=-1)
        * far[..., None]
    )


def test_a_batch_is_told(tmp_path: Any) -> None:
    np.save(tmp_path / "a.npy", BATCH)
    moved = BATCH + np.linspace(0.0, 90.0, 16)[:, None, None] * [1.0, 0.0, 0.0]
    for given in (
        BATCH,
        BATCH.astype("f4"),
        np.dstack([BATCH, BATCH]),
        moved,
        tmp_path / "a.npy",
        list(BATCH),
    ):
        with pytest.warns(UserWarning, match=r"if they are 16 clouds, give one of them, x\[0\]"):
            PointCloud.of(given)


@pytest.mark.parametrize("count", [3, 4, 6, 8, 16])
def test_a_batch_of_axes_is_refused(count: int) -> None:
    # Of three to six such clouds the first was read as x, the next as y, in silence.
    stack = np.moveaxis(np.resize(BATCH, (count, 256, 3)), 1, 2)
    with pytest.raises(ValueError, match=rf"if they are {count} clouds, give one, a point a row: x\[0\]\.T"):
        PointCloud.of(stack)
    PointCloud.of(stack[0].T)


def test_an_organised_scan_is_one_cloud() -> None:
    scan = _scan()
    firings = np.swapaxes(scan[[*range(0, 32, 2), *range(1, 32, 2)]], 0, 1)  # lasers out of order
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for given in (scan, np.where(scan == 0.0, np.nan, scan), firings, np.moveaxis(scan, -1, 0), scan[:8]):
            PointCloud.of(given, nonfinite="drop")
