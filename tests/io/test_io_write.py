# SPDX-License-Identifier: MIT
from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hybridreg.io import read_points, write_json, write_matrix, write_points

quick = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@quick
@given(hnp.arrays(np.float64, st.tuples(st.integers(0, 30), st.just(3))), st.sampled_from(["a.ply", "a.PCD"]))
def test_clouds_come_back_bit_for_bit(tmp_path, cloud, name):
    write_points(tmp_path / name, cloud, dtype="float64")
    assert read_points(tmp_path / name).tobytes() == cloud.tobytes()


def test_ply_keeps_doubles_and_pcd_refuses_to_lose_them(tmp_path, cloud, utm_cloud):
    write_points(tmp_path / "a.ply", utm_cloud)
    np.testing.assert_array_equal(read_points(tmp_path / "a.ply"), utm_cloud)
    write_points(tmp_path / "a.pcd", cloud)
    assert b"SIZE 4 4 4" in (tmp_path / "a.pcd").read_bytes()
    before = (tmp_path / "a.pcd").read_bytes()
    with pytest.raises(
        ValueError, match=r"a\.pcd: float32 would move coordinates of up to 5\.4.*write \.ply"
    ):
        write_points(tmp_path / "a.pcd", utm_cloud)
    assert (tmp_path / "a.pcd").read_bytes() == before


@pytest.mark.filterwarnings("error")
def test_pcd_takes_points_that_are_not_finite_and_refuses_the_far(tmp_path):
    points = np.array([[np.nan, np.inf, -np.inf], [1, 2, 3]])
    write_points(tmp_path / "a.pcd", points)
    np.testing.assert_array_equal(read_points(tmp_path / "a.pcd"), points)
    with pytest.raises(ValueError, match="by inf m"):
        write_points(tmp_path / "a.pcd", [[1e300, 0, 0]])


@pytest.mark.parametrize("name", ["a.ply", "a.pcd"])
def test_float32_on_request_halves_the_file(tmp_path, name, cloud, utm_cloud):
    write_points(tmp_path / name, cloud, dtype="float32")
    np.testing.assert_array_equal(read_points(tmp_path / name), cloud)
    header = (tmp_path / name).stat().st_size - cloud.size * 4
    write_points(tmp_path / name, utm_cloud, dtype="float64")
    assert abs((tmp_path / name).stat().st_size - header - utm_cloud.size * 8) < 10
    np.testing.assert_array_equal(read_points(tmp_path / name), utm_cloud)


@pytest.mark.parametrize("kind", [np.float32, ">f8", np.int32, "strided", "list"])
def test_other_arrays_are_written(tmp_path, kind, cloud):
    rounded = np.round(cloud)
    given_as = {"strided": rounded[:, ::1].T.copy().T, "list": rounded.tolist()}
    write_points(tmp_path / "a.ply", given_as[kind] if kind in given_as else rounded.astype(kind))
    np.testing.assert_array_equal(read_points(tmp_path / "a.ply"), rounded)


@pytest.mark.parametrize(
    "name, points, message",
    [
        ("a.xyz", np.zeros((5, 3)), r"'\.xyz'; choose a name ending in \.ply or \.pcd"),
        ("a", np.zeros((5, 3)), "''"),
        ("a.ply", np.zeros((5, 4)), r"shape \(5, 4\)"),
        ("a.ply", np.zeros(3), r"shape \(3,\)"),
        ("a.ply", np.zeros((5, 3), complex), "complex128"),
    ],
)
def test_refused_clouds_leave_no_file(tmp_path, name, points, message):
    with pytest.raises(ValueError, match=message):
        write_points(tmp_path / name, points)
    assert list(tmp_path.iterdir()) == []


def test_refused_type(tmp_path):
    with pytest.raises(ValueError, match=r"float16.*float64, float32"):
        write_points(tmp_path / "a.ply", np.zeros((5, 3)), dtype="float16")


finite = st.floats(allow_nan=False, allow_infinity=False)


@quick
@given(hnp.arrays(np.float64, (4, 4), elements=finite))
def test_numpy_reads_the_transform_bit_for_bit(tmp_path, matrix):
    write_matrix(tmp_path / "T.txt", matrix)
    assert np.loadtxt(tmp_path / "T.txt").tobytes() == matrix.tobytes()


@pytest.mark.parametrize("matrix", [np.eye(3), np.zeros((1, 4, 4)), np.diag([1, 1, 1, np.nan])])
def test_refused_transforms(tmp_path, matrix):
    with pytest.raises(ValueError, match=r"T\.txt: .*\(4, 4\)"):
        write_matrix(tmp_path / "T.txt", matrix)
    assert list(tmp_path.iterdir()) == []


def test_json_of_numpy_values(tmp_path):
    record = {"T": np.eye(2), "n": np.int64(7), "f": np.float32(0.5), "ok": np.bool_(True), "pair": (1, 2),
              "path": Path("runs") / "7", "name": "Straße", "none": None}  # fmt: skip
    write_json(tmp_path / "a.json", record)
    assert json.loads((tmp_path / "a.json").read_text(encoding="utf-8")) == {
        "T": [[1.0, 0.0], [0.0, 1.0]], "n": 7, "f": 0.5, "ok": True, "pair": [1, 2],
        "path": str(Path("runs") / "7"), "name": "Straße", "none": None,
    }  # fmt: skip


@pytest.mark.parametrize("thing", [float("nan"), np.array([np.inf]), {1, 2}, object(), {(1, 2): 3}])
def test_what_json_cannot_express_leaves_the_old_file(tmp_path, thing):
    write_json(tmp_path / "a.json", {"old": 1})
    with pytest.raises(ValueError, match=r"a\.json: cannot be written as JSON"):
        write_json(tmp_path / "a.json", {"new": thing})
    assert json.loads((tmp_path / "a.json").read_text()) == {"old": 1}


def test_a_cloud_is_written_with_its_offset(tmp_path):
    from hybridreg.cloud import PointCloud

    cloud = PointCloud.of(np.random.default_rng(0).normal(size=(50, 3)) + [500_000.0, 0.0, 0.0])
    with pytest.raises(ValueError, match=r"give cloud\.points \+ cloud\.offset"):
        write_points(tmp_path / "a.ply", cloud)
    write_points(tmp_path / "a.ply", cloud.points + cloud.offset)
    assert read_points(tmp_path / "a.ply")[:, 0].min() > 499_000.0
