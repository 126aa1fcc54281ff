# SPDX-License-Identifier: MIT
"""Made-up clouds and poses for the tests of the learned part."""

from __future__ import annotations

import numpy as np


def street(seed: int, n: int = 4000, extent: float = 20.0) -> np.ndarray:
    """(n, 3) float32: ground, two walls and some boxes, with noise."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-extent, extent, (n, 2))
    z = np.zeros(n)
    wall = rng.uniform(size=n) < 0.4
    z[wall] = rng.uniform(0, 6, wall.sum())
    xy[wall, 1] = np.where(rng.uniform(size=wall.sum()) < 0.5, -extent / 2, extent / 2)
    box = rng.uniform(size=n) < 0.2
    centres = rng.uniform(-extent, extent, (12, 2))
    xy[box] = centres[rng.integers(0, 12, box.sum())] + rng.uniform(-1, 1, (box.sum(), 2))
    z[box] = rng.uniform(0, 2, box.sum())
    return (np.column_stack([xy, z]) + rng.normal(scale=0.02, size=(n, 3))).astype(np.float32)


def yaw(degrees: float, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> np.ndarray:
    """(4, 4) turn about z and shift."""
    angle = np.radians(degrees)
    transform = np.eye(4)
    transform[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    transform[:3, 3] = shift
    return transform


def moved(points: np.ndarray, transform: np.ndarray) -> np.ndarray:
    """Points (n, 3) under a (4, 4) transform."""
    return (points @ transform[:3, :3].T + transform[:3, 3]).astype(np.float32)
