# SPDX-License-Identifier: MIT
from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from hybridreg.eval.report import cloud_pictures
from hybridreg.geometry import se3

ORANGE, BLUE = np.array([217, 95, 2]), np.array([59, 111, 182])


def columns(half: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Columns of a panel, below its legend, where many pixels have a colour."""
    near = np.abs(half[120:-60] - colour).sum(axis=2) < 90
    return np.flatnonzero(near.sum(axis=0) > 8)


def test_the_picture_shows_both_clouds_before_and_after(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    target = np.column_stack([rng.uniform(-20, 20, (40_000, 2)), np.zeros(40_000)])
    source = target[target[:, 0] > 0] - [60.0, 0.0, 0.0]
    cloud_pictures.before_after(
        tmp_path / "p.png", source, target, se3.from_rt(np.eye(3), np.array([60.0, 0.0, 0.0]))
    )
    image = cv2.imread(str(tmp_path / "p.png"))[:, :, ::-1].astype(int)
    before, after = image[:, : image.shape[1] // 2], image[:, image.shape[1] // 2 :]
    assert columns(before, ORANGE).max() < columns(before, BLUE).min()
    # Aligned, the source covers the right half of the target, so blue is left where orange begins.
    orange, blue = columns(after, ORANGE), columns(after, BLUE)
    assert abs(orange.min() - blue.max()) < 10
    assert abs(np.ptp(orange) - np.ptp(blue)) < 10
    assert list(tmp_path.iterdir()) == [tmp_path / "p.png"]


def test_map_returns_far_away_do_not_shrink_the_scene() -> None:
    near = np.random.default_rng(0).uniform(-10, 10, (1000, 3))
    stray = np.vstack([near, [[900.0, 900.0, 0.0]]])
    low, high = cloud_pictures.window(stray)
    assert np.all(high - low < 30.0)
