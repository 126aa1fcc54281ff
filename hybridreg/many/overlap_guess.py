# SPDX-License-Identifier: MIT
"""Which clouds may show one place, before anything is registered: how high things stand around the sensor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.geometry.extent import some

Array = NDArray[np.float64]

# Rings around the middle of what the sensor saw, out to nine tenths of the points; share of the lowest points.
_RINGS, _OUT_TO, _LOW = 24, 0.9, 0.05


def signature(cloud: PointCloud) -> Array:
    """Heights above the lowest points in rings around where the cloud was seen from, metres: (48,).

    Turning the cloud about the vertical changes nothing (after the ring key of Scan Context, Kim and Kim 2018).
    """
    points = some(cloud.points)
    middle = (
        cloud.viewpoint
        if cloud.viewpoint is not None and cloud.viewpoint.ndim == 1
        else np.median(points, axis=0)
    )
    distance = np.hypot(*(points[:, :2] - middle[:2]).T)
    height = points[:, 2] - np.quantile(points[:, 2], _LOW)
    edges = np.linspace(0.0, np.quantile(distance, _OUT_TO), _RINGS + 1)
    ring = np.clip(np.searchsorted(edges, distance, side="right") - 1, 0, _RINGS - 1)
    rows = [height[ring == k] for k in range(_RINGS)]
    parts = [np.quantile(row, (0.5, 0.95)) if len(row) else np.zeros(2) for row in rows]
    return np.concatenate(parts)


def unlike(signatures: list[Array]) -> Array:
    """How unlike clouds are, (n, n); the diagonal is infinite."""
    stacked = np.array(signatures)
    distance: Array = np.linalg.norm(stacked[:, None] - stacked[None], axis=2)
    np.fill_diagonal(distance, np.inf)
    return distance
