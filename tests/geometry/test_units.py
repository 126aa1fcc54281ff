# SPDX-License-Identifier: MIT
"""Units that are no metres are told, of the cloud whose they are."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from hybridreg import Pair, Pipeline, PointCloud, testing
from hybridreg.geometry import units

STREET = testing.sample_pair()[0]
NOTHING = Pipeline(match="none", estimate="identity", refine="none")


def said(source: np.ndarray, target: np.ndarray) -> dict[str, str]:
    return units.doubts(Pair.of(source, target))


def test_metres_are_not_doubted() -> None:
    a, b = STREET.source.points, STREET.target.points
    assert said(a, b) == {}
    assert said(a * 0.1, b * 0.1) == {}, "a room"
    assert said(a * 0.02, b * 0.02) == {}, "a thing on a table"
    assert said(a * 5, b * 5) == {}
    assert said(a + [5e5, 5.4e6, 100], b + [5e5, 5.4e6, 100]) == {}, "on a map's grid"
    assert said(np.round(a, 3), np.round(b, 2)) == {}


@pytest.mark.parametrize("blamed", ["source", "target"])
@pytest.mark.parametrize(
    "factor, unit",
    [(1000.0, "millimetres"), (100.0, "centimetres"), (1 / 0.0254, "inches"), (0.001, "kilometres")],
)
@pytest.mark.parametrize("size", [1.0, 0.2])
def test_one_cloud_in_another_unit_is_the_one_to_blame(
    blamed: str, factor: float, unit: str, size: float
) -> None:
    clouds = {"source": STREET.source.points * size, "target": STREET.target.points * size}
    clouds[blamed] = clouds[blamed] * factor
    found = said(clouds["source"], clouds["target"])
    assert list(found) == [blamed]
    assert unit in found[blamed]


def test_units_that_are_about_as_likely_are_both_named() -> None:
    found = said(STREET.source.points / 0.0254, STREET.target.points)
    assert "probably inches or centimetres; multiply by 0.0254 or 0.01 if so" in found["source"]


@pytest.mark.parametrize("factor, unit", [(1000.0, "millimetres"), (100.0, "centimetres")])
def test_whole_numbers(factor: float, unit: str) -> None:
    whole = (STREET.source.points * factor).astype(np.int32)
    found = said(whole, (STREET.target.points * factor).astype(np.int32))
    assert sorted(found) == ["source", "target"]
    assert all(unit in text for text in found.values())
    mixed = said(whole, STREET.target.points)
    assert list(mixed) == ["source"]
    assert unit in mixed["source"]


@pytest.mark.parametrize("reach", [600.0, 1600.0, 4000.0])
def test_whole_numbers_of_a_depth_camera_may_be_millimetres(reach: float) -> None:
    # Those that reach 1600 were said to be centimetres alone: a table as large as a hall.
    whole = np.random.default_rng(0).uniform(-reach, reach, (500, 3)).astype(np.int16)
    found = said(whole, whole + 3)
    assert all(
        "probably millimetres or centimetres; multiply by 0.001 or 0.01 if so" in text
        for text in found.values()
    )


@pytest.mark.parametrize("where", [(7.1, 50.7), (-122.4, 37.8), (151.2, -33.9)])
def test_longitude_and_latitude(where: tuple[float, float]) -> None:
    degrees = np.column_stack([STREET.source.points[:, :2] / 1e5 + where, STREET.source.points[:, 2] + 100])
    found = said(degrees, degrees.copy())
    assert sorted(found) == ["source", "target"]
    assert all("longitude and latitude" in text for text in found.values())
    assert list(said(degrees, STREET.target.points)) == ["source"]


def test_degrees_and_millimetres_of_flat_scans_are_told_by_a_run() -> None:
    # In degrees a town is so thin that it passed for a flat 2-D scan; walls were drawn into it, and nothing was said.
    run = Pipeline(match="none", estimate="identity", refine="none")
    flat = np.column_stack([STREET.source.points[:, :2], np.zeros(len(STREET.source.points))])
    near = STREET.source.points[:, :2] / 1e5 + [8.4, 49.0]
    degrees = np.column_stack([near, STREET.source.points[:, 2] + 100.0])
    for points, words in ((degrees, "longitude and latitude"), (np.round(100.0 * flat), "is a whole number")):
        with pytest.warns(UserWarning, match=words) as told:
            run.run(Pair.of(points, points[::-1].copy()))
        assert [str(each.message).split(":")[0] for each in told] == ["source", "target"]


def test_a_run_warns_once_and_names_the_cloud() -> None:
    pair = Pair.of(STREET.source.points, STREET.target.points * 1000)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        NOTHING.run(pair)
    texts = [str(each.message) for each in caught]
    assert len(texts) == 1, texts
    assert texts[0].startswith("target: it reaches")


def test_no_returns_are_told_and_left_out_on_request() -> None:
    points = STREET.source.points.copy()
    points[::3] = 0.0
    n = len(points[::3])
    with pytest.warns(UserWarning, match=rf"cloud: {n} of {len(points)} points lie exactly at \(0, 0, 0\)"):
        assert len(PointCloud.of(points)) == len(points)
    kept = PointCloud.of(points, nonfinite="drop")
    assert kept.dropped == n
    points[1::3] = np.nan
    both = PointCloud.of(points, nonfinite="drop", viewpoint=np.tile([0.0, 0.0, 1.0], (len(points), 1)))
    assert np.array_equal(both.points, points[2::3])


@pytest.mark.parametrize("height", [-9999.0, -99999.0, -32768.0])
def test_cells_without_data_are_told_and_left_out_on_request(height: float) -> None:
    # GDAL's XYZ, to which this library sends users with elevation models, writes them like others.
    points = STREET.source.points.copy()
    points[:3, 2] = height
    with pytest.warns(
        UserWarning, match=rf"cloud: 3 of {len(points)} points have the height {height:g}, which rasters"
    ):
        assert len(PointCloud.of(points)) == len(points)
    kept = PointCloud.of(points, nonfinite="drop", viewpoint=np.tile([0.0, 0.0, 1.0], (len(points), 1)))
    assert kept.dropped == 3
    assert np.array_equal(kept.points, points[3:])
    points[:, 2] = np.linspace(height, 0.0, len(points))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PointCloud.of(points)


def test_one_point_at_the_origin_is_a_point() -> None:
    points = np.vstack([STREET.source.points, np.zeros(3)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(PointCloud.of(points, nonfinite="drop")) == len(points)
