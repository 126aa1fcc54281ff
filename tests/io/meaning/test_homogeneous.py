# SPDX-License-Identifier: MIT
"""Triangulated points come with a fourth number that they are to be divided by."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest

from hybridreg.cloud import PointCloud

P = np.random.default_rng(6).uniform(-1.0, 1.0, (300, 3)) * [3.0, 2.0, 2.0] + [0.0, 0.0, 6.0]
H = np.c_[P, np.ones(300)] / np.linalg.norm(np.c_[P, np.ones(300)], axis=1, keepdims=True)


@pytest.mark.parametrize("kind", ["f8", "f4"])
def test_rows_of_length_one_are_refused_with_a_cure_that_works(kind: str) -> None:
    # They were read as points on a piece of a ball, in silence.
    for h in (H, -H, H.T, -H.T, H.reshape(10, 30, 4), np.moveaxis(H.reshape(10, 30, 4), -1, 0)):
        x = h.astype(kind)
        with pytest.raises(
            ValueError, match="homogeneous points and quaternions do; if they are points"
        ) as refused:
            PointCloud.of(x)
        cloud = PointCloud.of(eval(str(refused.value).split("fourth: ")[1], {"x": x}))
        np.testing.assert_allclose(cloud.points + cloud.offset, P, rtol=0, atol=1e-4)


def test_opencv_triangulates_so() -> None:
    cv2 = pytest.importorskip("cv2")
    camera = np.array([[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]])
    views = [camera @ np.c_[np.eye(3), [shift, 0.0, 0.0]] for shift in (0.0, -0.5)]
    seen = [(view @ np.c_[P, np.ones(300)].T) for view in views]
    x = cv2.triangulatePoints(*views, *(each[:2] / each[2] for each in seen))
    with pytest.raises(ValueError, match=r"divide them by the fourth: x\[:3\] / x\[3\]"):
        PointCloud.of(x)


def test_in_files_too(tmp_path: Path) -> None:
    np.savetxt(tmp_path / "a.txt", H, fmt="%.6f")
    np.save(tmp_path / "a.npy", H)
    for path in (tmp_path / "a.txt", tmp_path / "a.npy"):
        with pytest.raises(ValueError, match="all have the length 1"):
            PointCloud.of(path)


def test_points_of_length_one_are_points() -> None:
    ball = P / np.linalg.norm(P, axis=1, keepdims=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for table in (
            ball,
            np.c_[ball, np.zeros(300)],
            np.c_[P, np.ones(300)],
            np.c_[ball, np.linspace(0.1, 0.9, 300)],
        ):
            PointCloud.of(table)
