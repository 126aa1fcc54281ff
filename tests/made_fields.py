# SPDX-License-Identifier: MIT
"""A bare field, sampled twice."""

from __future__ import annotations

import numpy as np

import hybridreg as hr
from hybridreg.geometry import se3
from hybridreg.pair import Pair

_WAVES = 40
# Where the mound stands, in the target's frame, and its radius, metres.
MOUND, _RADIUS = np.array([4.0, -2.0]), 3.0


def field_pair(
    *, bumps: float = 0.02, noise: float = 0.01, points: int = 40_000, mound: float = 0.0
) -> tuple[Pair, np.ndarray]:
    """Two clouds of one field from places nine metres apart, and the true pose.

    Parameters
    ----------
    bumps : float
        Standard deviation of the ground's height, metres, in waves of 3 to 8 m.
    noise : float
        Of each point's height, metres.
    mound : float
        Height of one round mound between both places, metres.
    """
    rng = np.random.default_rng(0)
    number = 2.0 * np.pi / rng.uniform(3.0, 8.0, _WAVES)
    angle, phase = rng.uniform(0.0, 2.0 * np.pi, (2, _WAVES))
    k = np.column_stack([number * np.cos(angle), number * np.sin(angle)])
    truth = se3.yaw(70.0)
    truth[:3, 3] = 8.0, -4.0, 0.0

    def seen() -> np.ndarray:
        # Points about a sensor, fewer the farther away, in the frame of the target's sensor.
        reach, turn = 20.0 * np.sqrt(rng.uniform(0.01, 1.0, points)), rng.uniform(0.0, 2.0 * np.pi, points)
        return np.column_stack([reach * np.cos(turn), reach * np.sin(turn)])

    def laid(xy: np.ndarray) -> np.ndarray:
        height = bumps * np.sqrt(2.0 / _WAVES) * np.sin(xy @ k.T + phase).sum(axis=1)
        from_top = np.linalg.norm(xy - MOUND, axis=1) / _RADIUS
        height += mound * np.cos(0.5 * np.pi * np.minimum(from_top, 1.0)) ** 2
        return np.column_stack([xy, height + rng.normal(0.0, noise, len(xy)) - 1.8])

    target = laid(seen())
    source = se3.apply(se3.inverse(truth), laid(seen() + truth[:2, 3]))
    return Pair.of(*(hr.PointCloud(points=cloud) for cloud in (source, target))), truth
