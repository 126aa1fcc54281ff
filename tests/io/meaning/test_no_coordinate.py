# SPDX-License-Identifier: MIT
"""Columns that are no coordinates are told; depths, grids and flat scans are not taken for such."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from numpy.typing import NDArray

import hybridreg as hr
from hybridreg.io.meaning.no_coordinate import no_coordinate

Array = NDArray[np.float64]
RNG = np.random.default_rng(0)
POINTS = RNG.uniform(-30.0, 30.0, (3000, 3)) * [1.0, 1.0, 0.1]


def with_column(k: int, column: Array) -> Array:
    points = POINTS.copy()
    points[:, k] = column
    return points


@pytest.mark.parametrize(
    ("points", "told"),
    [
        (with_column(2, RNG.integers(0, 64, 3000)), "its z are whole numbers from 0 to 63"),
        (with_column(2, RNG.integers(0, 256, 3000)), "its z are whole numbers from 0 to 255"),
        (with_column(0, RNG.integers(1, 17, 3000)), "its x are whole numbers from 1 to 16"),
        (POINTS[:, [0, 1, 0]], "its x and its z are the same"),
        (POINTS[:, [1, 1, 2]], "its x and its y are the same"),
    ],
    ids=["rings", "intensities", "first", "x twice", "y twice"],
)
def test_they_are_told_with_the_cloud(points: Array, told: str) -> None:
    with pytest.warns(UserWarning, match=f"target: {told}"):
        hr.Pair.of(POINTS, points)


@pytest.mark.parametrize(
    "points",
    [
        POINTS,
        np.round(POINTS),  # all whole
        with_column(2, np.round(RNG.uniform(400.0, 900.0, 3000))),  # depths in millimetres
        with_column(2, np.zeros(3000)),
        np.where([True, True, False], np.round(POINTS), np.round(POINTS, 1)),  # a grid
        POINTS[:50, [0, 1, 0]],  # too few to tell
        with_column(2, np.round(RNG.uniform(-90.0, 90.0, 3000))),  # heights below zero
    ],
    ids=["as they are", "whole", "depths", "flat", "grid", "few", "heights"],
)
def test_coordinates_are_not(points: Array) -> None:
    assert no_coordinate(points) is None


@pytest.mark.parametrize("side", ["source", "target"])
def test_a_flat_cloud_beside_one_that_is_not_is_told(side: str) -> None:
    clouds = {"source": POINTS, "target": POINTS} | {side: with_column(2, np.zeros(3000))}
    with pytest.warns(UserWarning, match=f"{side}: all its z are 0, and the"):
        hr.register(**clouds, preset="icp")


def test_two_flat_scans_are_not() -> None:
    flat = with_column(2, np.zeros(3000))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hr.register(flat, flat + [0.1, 0.0, 0.0], preset="icp")
