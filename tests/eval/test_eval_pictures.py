# SPDX-License-Identifier: MIT
from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from hybridreg import se3
from hybridreg.eval import pictures

ORANGE, BLUE = np.array([217, 95, 2]), np.array([59, 111, 182])


def test_the_picture_shows_both_clouds_before_and_after(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    target = np.column_stack([rng.uniform(-20, 20, 20_000), rng.uniform(-20, 20, 20_000), np.zeros(20_000)])
    T = se3.from_rt(np.eye(3), np.array([200.0, 0.0, 0.0]))
    pictures.before_after(tmp_path / "p.png", se3.apply(se3.inverse(T), target[:10_000]), target, T)
    image = cv2.imread(str(tmp_path / "p.png"))[:, :, ::-1].astype(int)
    assert image.shape[0] > 300
    left, right = image[:, : image.shape[1] // 2], image[:, image.shape[1] // 2 :]

    def columns(half: np.ndarray, colour: np.ndarray) -> np.ndarray:
        # Below the legend, whose dots have the same colours.
        near = np.abs(half[80:-60] - colour).sum(axis=2) < 90
        return np.flatnonzero(near.any(axis=0))

    apart = columns(left, BLUE).mean() - columns(left, ORANGE).mean()
    assert apart > 150
    assert abs(columns(right, BLUE).mean() - columns(right, ORANGE).mean()) < 25
    assert list(tmp_path.iterdir()) == [tmp_path / "p.png"]
