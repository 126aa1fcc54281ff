# SPDX-License-Identifier: MIT
"""What the entrance takes, and how it refuses the rest."""

from __future__ import annotations

import io
import pickle
import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

import hybridreg as hr
import hybridreg.testing
from hybridreg import PointCloud

GOOD = np.random.default_rng(0).uniform(-10, 10, (50, 3))


def with_row(value: Any) -> np.ndarray:
    bad = GOOD.copy()
    bad[17, 1] = value
    return bad


@pytest.mark.parametrize(
    "x, words",
    [
        (np.zeros((0, 3)), "empty"),
        (np.zeros(0), "empty"),
        ([], "empty"),
        (GOOD[:19], "19 points are too few.*at least 20"),
        (GOOD[:1], "1 points are too few"),
        (with_row(np.nan), "1 of 50 points are not finite.*row 17.*nonfinite"),
        (with_row(np.inf), "1 of 50 points are not finite"),
        (np.ones((50, 3)), "all 50 points lie in one place"),
        (np.full((50, 3), 1e6), "one place"),
        (np.outer(np.arange(50), [1.0, 2.0, 3.0]), "on one line"),
        (GOOD[:, :2], r"got \(50, 2\)"),
        (GOOD[:2].T, r"got \(3, 2\)|too few"),
        (GOOD.astype(str), "dtype"),
        (GOOD.astype(complex), "dtype complex128"),
        (GOOD > 0, "dtype bool"),
        (np.array([None] * 60).reshape(20, 3), "dtype object"),
        ([[1, 2, 3], [4, 5]], "cannot read"),
        (with_row(1e12), "1e.12 m cannot be real, 1 of .* remove them where they stand for missing returns"),
        (None, "NoneType.*column_stack"),
        (3.0, "shape"),
    ],
)
def test_refuses(x: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words) as caught:
        PointCloud.of(x, name="target")
    assert str(caught.value).startswith("target: "), "the message names the cloud"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_drops_nonfinite_points_only_when_asked(value: float) -> None:
    cloud = PointCloud.of(with_row(value), nonfinite="drop")
    assert len(cloud) == 49
    assert cloud.dropped == 1


def test_every_entrance_takes_the_cure_that_it_names() -> None:
    holed = hr.testing.sample_pair()[0].target.points.copy()
    holed[5] = np.nan
    pipe = hr.Pipeline(match="none", estimate="identity", refine="none", voxel=0.5)
    with pytest.raises(ValueError, match='nonfinite="drop"'):
        pipe(holed, holed)
    assert any("missing" in note for note in pipe(holed, holed, nonfinite="drop").notes)
    with pytest.raises(ValueError, match='nonfinite="drop"'):
        hr.register_all([holed, holed], pipeline=pipe)
    assert len(hr.register_all([holed, holed], pipeline=pipe, nonfinite="drop").poses) == 2


def test_dropping_everything_is_an_empty_cloud() -> None:
    with pytest.raises(ValueError, match="empty"):
        PointCloud.of(np.full((50, 3), np.nan), nonfinite="drop")


@pytest.mark.parametrize("dtype", [np.float32, np.float16, np.int32, np.uint8])
def test_takes_any_number(dtype: type) -> None:
    array = (GOOD + 11).astype(dtype)
    assert np.array_equal(PointCloud.of(array).points, array.astype(np.float64))


def test_takes_lists_and_more_columns() -> None:
    assert np.array_equal(PointCloud.of(GOOD.tolist()).points, GOOD)
    assert np.array_equal(PointCloud.of(np.hstack([GOOD, GOOD])).points, GOOD)


def test_takes_a_torch_tensor() -> None:
    torch = pytest.importorskip("torch")
    assert np.array_equal(PointCloud.of(torch.tensor(GOOD, requires_grad=True)).points, GOOD)


def test_takes_open3d_clouds() -> None:
    from hybridreg.runtime.open3d import load_open3d

    try:
        o3d = load_open3d()
    except ImportError as error:
        pytest.skip(str(error))
    legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(GOOD))
    assert np.array_equal(PointCloud.of(legacy).points, GOOD)
    tensor = o3d.t.geometry.PointCloud(o3d.core.Tensor(GOOD))
    assert np.array_equal(PointCloud.of(tensor).points, GOOD)
    for empty in (o3d.geometry.PointCloud(), o3d.t.geometry.PointCloud()):
        with pytest.raises(ValueError, match="empty"):
            PointCloud.of(empty)


def test_takes_whatever_has_points() -> None:
    assert np.array_equal(PointCloud.of(SimpleNamespace(points=GOOD)).points, GOOD)


def test_the_caller_keeps_its_array() -> None:
    mine = GOOD.copy()
    cloud = PointCloud.of(mine)
    mine[:] = 0
    assert np.array_equal(cloud.points, GOOD)
    with pytest.raises(ValueError, match="read-only"):
        cloud.points[0] = 0


@given(
    arrays(
        st.sampled_from([np.float64, np.float32, np.int16]),
        array_shapes(min_dims=1, max_dims=3, max_side=40),
    )
)
@settings(max_examples=200, deadline=None)
def test_any_array_is_taken_or_refused_in_words(x: np.ndarray) -> None:
    try:
        cloud = PointCloud.of(x, name="source")
    except ValueError as error:
        assert str(error).startswith("source: ")
    else:
        assert np.isfinite(cloud.points).all()
        assert len(cloud) >= 20


@given(st.integers(0, 2**32 - 1), st.floats(1e-6, 1e6))
@settings(max_examples=50, deadline=None)
def test_a_spread_cloud_of_any_size_passes(seed: int, scale: float) -> None:
    points = np.random.default_rng(seed).normal(size=(30, 3)) * scale
    assert len(PointCloud.of(points)) == 30


def test_offset_comes_off_in_whole_kilometres() -> None:
    shift = np.array([5e6, -4e5, 2e4])
    cloud = PointCloud.of(GOOD + shift)
    assert np.array_equal(cloud.offset, shift)
    assert np.allclose(cloud.points, GOOD, atol=1e-8)
    assert np.array_equal(PointCloud.of(GOOD + 900.0).offset, np.zeros(3)), "900 m is no map grid"


def test_pickles() -> None:
    cloud = pickle.loads(pickle.dumps(PointCloud.of(GOOD, sensor="fan")))
    assert cloud.sensor == "fan"
    assert np.array_equal(cloud.points, GOOD)


@pytest.mark.parametrize("dtype, told", [("f4", True), ("f8", False)])
def test_map_coordinates_in_single_precision_are_told(dtype: str, told: bool) -> None:
    points = np.random.default_rng(0).uniform(-20.0, 20.0, (200, 3)) + [4e5, 5.3e6, 500.0]
    points = np.vstack([points, np.zeros((300, 3))])  # missing returns
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        PointCloud.of(points.astype(dtype), name="map")
    assert any("map: its coordinates were kept in single precision" in str(w.message) for w in seen) == told


@pytest.mark.parametrize(
    ("east", "north", "spacing"),
    [
        (4.5e5, 5.4e6, 0.5),
        (4.5e5, 5.4e6, 1.0),
        (4.5e5 + 0.5, 5.4e6 + 0.5, 1.0),
        (4.5e6, 5.4e6, 1.0),
        (2.6e6 + 0.25, 1.2e6 + 0.75, 0.5),
        (4.5e5, 5.4e6, 10.0),
        (4.5e6, 5.4e6, 20.0),
        (4.5e5, 5.4e6, 25.0),
    ],
)
def test_a_grid_of_heights_in_a_map_was_not_rounded(east: float, north: float, spacing: float) -> None:
    # As elevation models come, and as gdal_translate writes them; they were told to be in single precision,
    # or written with six digits.
    x, y = (each.ravel() for each in np.meshgrid(np.arange(40) * spacing, np.arange(50) * spacing))
    heights = np.round(300.0 + 3.0 * np.sin(x) + np.cos(y), 2)
    points = np.c_[x + east, y + north, heights]
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        PointCloud.of(points, name="map")
    assert not [str(w.message) for w in seen if "far from the origin" in str(w.message)]


@pytest.mark.parametrize(
    "digits, offset, apart",
    [
        ("%.6g", [500_000.0, 5_400_000.0, 300.0], "10 m"),  # UTM
        ("%.6g", [600_000.0, 200_000.0, 300.0], "1 m"),
        ("%.6g", [15_000.0, 28_000.0, 300.0], "0.1 m"),
        ("%.6g", [1_000.0, 2_000.0, 300.0], ""),
        ("%.6g", [0.0, 0.0, 0.0], ""),
        ("%.10g", [500_000.0, 5_400_000.0, 300.0], ""),
        ("%.1f", [15_000.0, 28_000.0, 300.0], ""),  # a raster of heights
    ],
)
def test_map_coordinates_of_six_digits_are_told(digits: str, offset: list[float], apart: str) -> None:
    # As Open3D 0.20.0 writes PLY in ascii and OpenCV 5.0.0 writes OBJ.
    points = np.random.default_rng(0).uniform(-20.0, 20.0, (200, 3)) + offset
    written = np.array([[float(digits % value) for value in point] for point in points])
    if digits == "%.1f":
        written[:, 2] = points[:, 2]
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        PointCloud.of(np.vstack([written, np.zeros((1, 3))]), name="map")
    words = [str(each.message) for each in seen]
    assert len(words) == bool(apart)
    assert all(
        f"map: its coordinates were written with six digits far from the origin, {apart} apart" in w
        for w in words
    )


def test_a_sensor_frame_in_single_precision_is_fine() -> None:
    points = np.random.default_rng(0).uniform(-200.0, 200.0, (200, 3)).astype("f4")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PointCloud.of(points, name="scan")


@pytest.mark.parametrize("tiny", [1e-320, 5e-324, -1e-310, 1e-30])
def test_numbers_next_to_zero_are_no_rounding(tiny: float) -> None:
    points = np.random.default_rng(0).uniform(-20.0, 20.0, (300, 3))
    points[7] = tiny
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        hr.PointCloud.of(points)


def test_an_open_file_is_refused_with_a_cure() -> None:
    with pytest.raises(ValueError, match="pass the path of the file"):
        PointCloud.of(io.BytesIO(b"ply"))


def test_a_stray_point_far_away_is_no_map() -> None:
    points = np.random.default_rng(0).uniform(-20.0, 20.0, (200, 3)).astype(np.float32)
    points[3] = [8e5, 2e6, -4e4]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PointCloud.of(points, name="scan")


@pytest.mark.parametrize("height", [-9999.0, -999.0, -999999.0, -32767.0, 9999.0, 99999.0, 1e6])
def test_heights_of_cells_without_data(height: float) -> None:
    # -999 and those above the others, as BAG's 1,000,000, were read as points.
    z = GOOD[:, 2] + (600.0 if height < 0.0 else 300.0)
    empty = np.c_[GOOD[:, :2], np.where(np.arange(50) % 9 == 4, height, z)]
    with pytest.warns(UserWarning, match=f"of 50 points have the height {height:.12g}, which rasters write"):
        PointCloud.of(empty)
    assert len(PointCloud.of(empty, nonfinite="drop")) == 44
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PointCloud.of(np.c_[GOOD[:, :2], np.where(np.arange(50) == 4, height, 0.8 * height + GOOD[:, 2])])
