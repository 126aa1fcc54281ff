# SPDX-License-Identifier: MIT
"""Scenes and matches whose pose is known."""

from __future__ import annotations

import numpy as np

from hybridreg.geometry import se3
from hybridreg.matches import Correspondences


def random_pose(rng: np.random.Generator, metres: float = 5.0) -> np.ndarray:
    return se3.from_rt(se3.random_rotation(rng), rng.uniform(-metres, metres, 3))


def planted(
    seed: int, n: int = 1000, inlier_ratio: float = 0.2, noise: float = 0.05
) -> tuple[Correspondences, np.ndarray, np.ndarray]:
    """Matches in a 60 x 60 x 8 m street, the true pose, and which of them are true."""
    rng = np.random.default_rng(seed)
    T = random_pose(rng)
    source = rng.uniform([-30, -30, -2], [30, 30, 6], (n, 3))
    target = se3.apply(T, rng.permutation(source))
    true = np.arange(n) < round(inlier_ratio * n)
    target[true] = se3.apply(T, source[true]) + rng.normal(0.0, noise, (int(true.sum()), 3))
    return Correspondences.of(source, target), T, true


def street(seed: int, n: int = 12_000) -> np.ndarray:
    """Ground, house fronts that step back and forth, boxes: points (n, 3), the sensor at the origin."""
    rng = np.random.default_rng(seed)
    parts = [np.column_stack([rng.uniform(-25, 25, (n // 3, 2)), rng.normal(-1.8, 0.01, n // 3)])]
    for x in np.arange(-25.0, 25.0, 6.0):
        for side in (-1.0, 1.0):
            depth, height = side * rng.uniform(8, 14), rng.uniform(2, 9)
            front = rng.uniform([x, depth, -1.8], [x + 6, depth + 0.01, height], (n // 40, 3))
            flank = [x, depth, -1.8] + rng.uniform(0, 1, (n // 80, 3)) * [0.01, 4 * side, height + 1.8]
            parts += [front, flank]
    for _ in range(14):
        corner = np.array([*rng.uniform(-20, 20, 2), -1.8])
        parts.append(corner + rng.uniform(0, 1, (n // 80, 3)) * rng.uniform(0.2, [4, 2, 3], 3))
    return np.concatenate(parts)
