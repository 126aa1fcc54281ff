# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest

import hybridreg as hr
from hybridreg.geometry.extent import bounds, radii, sample, share_within


@pytest.mark.parametrize("order", ["C", "F"])
def test_reach_is_numpys_and_leaves_the_points_alone(order: str) -> None:
    points = np.array(np.random.default_rng(0).normal(size=(500, 3)), order=order)  # type: ignore[call-overload]
    before = points.copy()
    distances = np.sort(np.linalg.norm(points - np.median(points, axis=0), axis=1))
    assert radii(points) == pytest.approx(distances)
    assert np.array_equal(bounds(points), [points.min(axis=0), points.max(axis=0)])
    assert share_within(radii(points), 0.5) == pytest.approx(np.median(distances), rel=0.02)
    assert np.array_equal(points, before)


def test_a_cloud_that_lies_column_by_column_has_a_reach() -> None:
    points = np.random.default_rng(0).normal(size=(500, 3))
    across, along = (hr.PointCloud.of(np.array(points, order=order)) for order in ("F", "C"))  # type: ignore[call-overload]
    assert np.array_equal(across.radii, along.radii)


def test_a_sample_is_of_every_ring_and_always_the_same() -> None:
    rings, columns = 64, 2048  # an organised cloud, ring by ring within each column
    points = np.column_stack(
        [np.tile(np.arange(rings), columns), np.arange(rings * columns), np.zeros(rings * columns)]
    )
    drawn = sample(points, 4_000)
    assert len(drawn) == 4_000
    assert len(np.unique(drawn[:, 0])) == rings
    assert np.all(np.diff(drawn[:, 1]) > 0)
    assert np.array_equal(drawn, sample(points, 4_000))
    assert np.array_equal(sample(points[:10], 4_000), points[:10])
