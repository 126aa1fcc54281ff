# SPDX-License-Identifier: MIT
"""Ends of simulated rays that met nothing lie on a sphere around the sensor, at its reach."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud

Array = NDArray[np.float64]

P = np.random.default_rng(4).uniform(-20.0, 20.0, (20_000, 3)) * [1.0, 1.0, 0.2]


def _ways(count: int, up: float = 0.5) -> Array:
    d = np.random.default_rng(5).normal(size=(count, 3))
    d[:, 2] = up * np.abs(d[:, 2])
    ways: Array = d / np.linalg.norm(d, axis=1)[:, None]
    return ways


@pytest.mark.parametrize("reach", [30.0, 100.0, 1000.0])
@pytest.mark.parametrize("stored", [lambda p: p, lambda p: p.astype("f4"), lambda p: np.round(p, 3)])
def test_rays_that_met_nothing_are_told_and_dropped(reach: float, stored: object) -> None:
    cloud = stored(np.vstack([P, reach * _ways(3000)]))  # type: ignore[operator]
    with pytest.warns(
        UserWarning, match=f"target: 3000 of 23000 points lie {reach:g} m from the origin, all others nearer"
    ):
        PointCloud.of(cloud, name="target")
    kept = PointCloud.of(cloud, nonfinite="drop")
    assert len(kept) == len(P)
    assert kept.dropped == 3000
    assert np.allclose(kept.points, P, atol=0.01)


def test_with_zeros_and_nan_besides() -> None:
    cloud = np.vstack([np.full((500, 3), np.nan), P, np.zeros((400, 3)), 80.0 * _ways(900)])
    kept = PointCloud.of(cloud, nonfinite="drop")
    assert np.array_equal(kept.points, P)
    assert kept.dropped == 1800


def _rings() -> Array:
    # Sixteen rings on flat ground, each at one range; walls hide a part of the longest.
    way, down = np.linspace(0.0, 2.0 * np.pi, 1800), np.radians(np.linspace(4.0, 24.0, 16))[:, None]
    far = 1.73 / np.tan(down)
    return np.stack([far * np.cos(way), far * np.sin(way), np.full((16, 1800), -1.73)], -1).reshape(-1, 3)


@pytest.mark.parametrize(
    "cloud",
    [
        5.0 * _ways(5000, 1.0),  # a dome, and nothing else
        P[np.linalg.norm(P, axis=1) < 15.0],  # cut at a distance
        _rings(),
        np.vstack([0.3 * _rings()[-3600:], _rings()[:1800]]),  # one ring that nothing hides, about near ones
        np.round(np.linalg.norm(P, axis=1) * 2.0)[:, None] / 2.0 * _ways(len(P)) + [0.0, 0.0, 1e-9],  # bins
        np.vstack([P[P[:, 0] > 0.0], 0.999 * _ways(20_000)]),  # a ball that was seen
        P / np.abs(P).max(axis=1)[:, None] * [20.0, 15.0, 3.0] + [7.0, 0.0, 1.0],  # a room
        0.3 * np.round(P / 0.3),  # a grid
        np.vstack([P, 30.0 * _ways(150)]),  # few
    ],
    ids=["dome", "cut", "rings", "one ring", "bins", "ball", "room", "grid", "few"],
)
def test_what_lies_far_for_another_reason_is_left_alone(cloud: Array) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(PointCloud.of(cloud, nonfinite="drop")) == len(cloud)
        PointCloud.of(cloud)


@pytest.mark.parametrize("place", [[0.0, 0.0, 1.8], [40.0, -7.0, 1.0], [500_000.0, 5_400_000.0, 300.0]])
@pytest.mark.parametrize("up", [0.05, 0.5, 1.0])
def test_a_sphere_about_another_place_is_told_and_dropped(place: list[float], up: float) -> None:
    cloud = np.vstack([P, 60.0 * _ways(3000, up)]) + place
    with pytest.warns(UserWarning, match="target: 3000 of 23000 points lie 60 m from .*, all others nearer"):
        PointCloud.of(cloud, name="target")
    kept = PointCloud.of(cloud, nonfinite="drop")
    assert (len(kept), kept.dropped) == (len(P), 3000)


def test_a_sphere_about_another_place_in_digits_and_single_precision() -> None:
    cloud = np.vstack([P, 60.0 * _ways(3000)]) + [40.0, -7.0, 1.0]
    for stored in (np.round(cloud, 2), cloud.astype("f4")):
        assert len(PointCloud.of(stored, nonfinite="drop")) == len(P)


@pytest.mark.parametrize("stored", [lambda p: p, lambda p: p.astype("f4")])
def test_distances_of_minus_one_are_told_and_dropped(stored: object) -> None:
    cloud = stored(np.vstack([P, -_ways(3000)]))  # type: ignore[operator]
    with pytest.warns(
        UserWarning, match="target: 3000 of 23000 points lie 1 m from the origin, in all directions"
    ):
        PointCloud.of(cloud, name="target")
    assert len(PointCloud.of(cloud, nonfinite="drop")) == len(P)
