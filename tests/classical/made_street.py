# SPDX-License-Identifier: MIT
"""Two views of one made street block, from sensors that stand apart and hang askew."""

from __future__ import annotations

import numpy as np

from hybridreg.geometry import se3
from hybridreg.pair import Pair

HEIGHT = 1.8


def block(seed: int = 0, reach: float = 45.0) -> np.ndarray:
    """World points (n, 3): ground at z = 0, houses of several heights, poles, boxes the size of cars."""
    rng = np.random.default_rng(seed)
    parts = [np.column_stack([rng.uniform(-reach, reach, (14_000, 2)), rng.normal(0.0, 0.02, 14_000)])]
    for _ in range(26):
        corner, size = rng.uniform(-reach, reach, 2), rng.uniform([1.5, 1.5, 1.2], [9.0, 9.0, 9.0])
        u, v = rng.uniform(0.0, 1.0, (2, 900))
        x, y = np.where(u < 0.5, 2.0 * u, rng.integers(0, 2, 900)), np.where(u < 0.5, 0.0, 2.0 * u - 1.0)
        parts.append(np.column_stack([corner + size[:2] * np.column_stack([x, y]), size[2] * v]))
    for _ in range(20):
        foot = rng.uniform(-reach, reach, 2) + rng.normal(0.0, 0.08, (60, 2))
        parts.append(np.column_stack([foot, rng.uniform(0.0, 6.0, 60)]))
    return np.concatenate(parts)


def pose(x: float, y: float, yaw_deg: float, tilt_deg: float, towards_deg: float = 0.0) -> np.ndarray:
    """T_world_sensor of a sensor at (x, y), turned, then tilted about a horizontal axis."""
    towards = np.radians(towards_deg)
    tilt = se3.rotation_about(np.radians(tilt_deg) * np.array([np.cos(towards), np.sin(towards), 0.0]))
    return se3.from_rt(se3.yaw(yaw_deg)[:3, :3] @ tilt, np.array([x, y, HEIGHT]))


def seen(world: np.ndarray, T_world_sensor: np.ndarray, reach: float = 40.0, seed: int = 0) -> np.ndarray:
    """Points within reach, less every third, in the sensor's frame."""
    near = world[np.hypot(*(world[:, :2] - T_world_sensor[:2, 3]).T) < reach]
    kept = np.random.default_rng(seed).random(len(near)) < 0.67
    return se3.apply(se3.inverse(T_world_sensor), near[kept])


def two_views(
    T_world_source: np.ndarray, T_world_target: np.ndarray, seed: int = 0
) -> tuple[Pair, np.ndarray]:
    """The pair and its truth."""
    world = block(seed)
    pair = Pair.of(seen(world, T_world_source, seed=1), seen(world, T_world_target, seed=2))
    return pair, se3.inverse(T_world_target) @ T_world_source
