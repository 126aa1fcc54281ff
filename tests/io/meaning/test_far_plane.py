# SPDX-License-Identifier: MIT
"""Pixels of a rendered depth image that met nothing lie in its far plane."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud

Array = NDArray[np.float64]

V, U = np.mgrid[:60, :80] + 0.5
RAYS = np.stack([(U - 40.0) / 60.0, (V - 30.0) / 60.0, np.ones_like(U)], -1)
DEPTH = np.where(V > 31.0, np.minimum(1.5 * 60.0 / np.maximum(V - 30.0, 1e-9), 40.0), np.inf)  # a floor
DEPTH[20:45, 10:30] = 6.0 + 0.01 * U[20:45, 10:30]  # a thing
MISSED = int(np.isinf(DEPTH).sum())
TO_VEHICLE = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])


def _points(far: float) -> Array:
    points: Array = (np.minimum(DEPTH, far)[..., None] * RAYS).reshape(-1, 3)
    return points


@pytest.mark.parametrize(
    "seen, plane",
    [
        (lambda p: p, "z = 1000"),
        (lambda p: p.astype("f4"), "z = 1000"),
        (lambda p: np.round(p, 2), "z = 1000"),
        (lambda p: p * [1.0, -1.0, -1.0], "z = -1000"),  # OpenGL's axes
        (lambda p: p @ TO_VEHICLE, "x = 1000"),
        (lambda p: p[::7], "z = 1000"),
    ],
)
def test_the_far_plane_is_told(seen: object, plane: str) -> None:
    with pytest.warns(
        UserWarning, match=rf"target: \d+ of \d+ points lie exactly in the plane {plane}, all others"
    ):
        PointCloud.of(seen(_points(1000.0)), name="target")  # type: ignore[operator]


@pytest.mark.parametrize(
    "cloud",
    [
        _points(1000.0)[np.isfinite(DEPTH).ravel()],
        _points(10.0),  # a wall at whose foot the floor ends
        _points(1000.0) + np.random.default_rng(0).normal(0.0, 0.05, (4800, 3)),
        _points(1000.0) - [0.0, 0.0, 20.0],  # not from a camera at the origin
        RAYS.reshape(-1, 3) * [4.0, 4.0, 5.5],  # a wall alone
    ],
    ids=["cut", "wall", "noise", "moved", "alone"],
)
def test_others_are_not(cloud: Array) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PointCloud.of(cloud)
