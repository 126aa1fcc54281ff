# SPDX-License-Identifier: MIT
"""What stands beside an array of points: a scale, an offset, a mask, normals, a second cloud."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hybridreg import PointCloud

P = np.random.default_rng(0).normal(size=(60, 3)) * [5, 4, 2]
WHOLE = np.round(P * 1000).astype("i4")
HALF = np.arange(60) % 2 == 0
COLUMNS = dict(zip("xyz", WHOLE.T, strict=True))


def record(points: np.ndarray, **others: np.ndarray) -> np.ndarray:
    held = {**dict(zip("xyz", points.T, strict=True)), **others}
    array = np.zeros(len(points), [(key, np.asarray(values).dtype) for key, values in held.items()])
    for key, values in held.items():
        array[key] = values
    return array


def ways(tmp_path: Path, entries: dict[str, Any]) -> list[Any]:
    np.savez(tmp_path / "a.npz", **entries)
    with np.load(tmp_path / "a.npz") as archive:
        return [entries, tmp_path / "a.npz", dict(archive)]


@pytest.mark.parametrize(
    "entries",
    [
        {"xyz": WHOLE, "scale": 0.001},
        {"points": WHOLE, "scale": np.full(3, 0.001), "offset": np.array([100.0, 0, 0])},
        {"points": WHOLE.astype(float), "scale_factor": np.array([0.001])},
        {"xyz": WHOLE, "xyz_scale": 1e-3},
        {**COLUMNS, "scale": 0.001},
        {"xyz": WHOLE, "voxel_size": 0.05},
    ],
)
def test_whole_numbers_with_a_scale_are_refused(entries: dict[str, Any], tmp_path: Path) -> None:
    for x in ways(tmp_path, entries):
        with pytest.raises(
            ValueError, match=r"whole numbers, and '.*' beside them is 0\.0.*multiply them by it"
        ) as told:
            PointCloud.of(x)
        assert ("add 'offset'" in str(told.value)) == ("offset" in entries)


def test_a_scale_in_the_attributes_of_xarray_counts_too() -> None:
    xr = pytest.importorskip("xarray")
    attributes = {"scale_factor": 0.001, "add_offset": 5.0}
    for x in (
        xr.Dataset({key: ("n", values, attributes) for key, values in COLUMNS.items()}),
        xr.Dataset({key: ("n", values) for key, values in COLUMNS.items()}, attrs=attributes),
        xr.DataArray(WHOLE, attrs=attributes),
    ):
        with pytest.raises(ValueError, match="'scale_factor' beside them is 0"):
            PointCloud.of(x)


class Variable:
    """As netCDF4's: `scale` says whether it multiplies by its scale itself."""

    def __init__(self, values: np.ndarray, scale: bool) -> None:
        self.values, self.scale, self.shape, self.ndim = values, scale, values.shape, values.ndim

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return np.asarray(self.values * 0.001 if self.scale else self.values, dtype)

    def __getitem__(self, key: Any) -> Any:
        return np.asarray(self)[key]

    def __len__(self) -> int:
        return len(self.values)

    def ncattrs(self) -> list[str]:
        return ["scale_factor"]

    def getncattr(self, key: str) -> float:
        return {"scale_factor": 0.001}[key]


def test_variables_of_netcdf_that_do_not_scale_themselves() -> None:
    # Before, millimetres were metres without a word.
    def variables(scale: bool) -> list[Any]:
        whole = Variable(WHOLE, scale)
        return [whole, {"points": whole}, {key: Variable(each, scale) for key, each in COLUMNS.items()}]

    for x in variables(False):
        with pytest.raises(ValueError, match="'scale_factor' beside them is 0.001"):
            PointCloud.of(x)
    for x in variables(True):
        np.testing.assert_array_equal(PointCloud.of(x).points, WHOLE * 0.001)


@pytest.mark.parametrize(
    "entries, words",
    [
        ({"points": P, "scale": 0.87}, "'scale' beside its points is 0.87, which was not applied"),
        ({"points": P, "offset": np.array([1.0, 2, 3])}, "'offset' beside its points is 1, 2, 3"),
        ({"points": P, "global_shift": [4e5, 5e6, 0.0]}, "'global_shift' beside"),
        ({"points": P, "mask": HALF}, "'mask' beside its points is true for 30 of 60"),
    ],
)
def test_what_may_change_the_points_is_told(entries: dict[str, Any], words: str, tmp_path: Path) -> None:
    for x in ways(tmp_path, entries):
        with pytest.warns(UserWarning, match=r"was not applied|was not\s+applied") as told:
            np.testing.assert_array_equal(PointCloud.of(x).points, P)
        assert any(words in str(each.message) for each in told)


@pytest.mark.parametrize("key, flags", [("valid", HALF), ("is_valid", HALF.astype("u1")), ("invalid", ~HALF)])
def test_points_that_are_not_valid_are_left_out_and_told(key: str, flags: np.ndarray, tmp_path: Path) -> None:
    pd = pytest.importorskip("pandas")
    columns = {**dict(zip("xyz", P.T, strict=True)), key: flags}
    pd.DataFrame(columns).to_csv(tmp_path / "a.csv", index=False)
    with pytest.warns(UserWarning, match=rf"a\.csv: 30 of 60 points are not valid by '{key}'"):
        np.testing.assert_allclose(PointCloud.of(tmp_path / "a.csv").points, P[HALF])
    for x in (
        *ways(tmp_path, {"points": P, key: flags}),
        columns,
        pd.DataFrame(columns),
        record(P, **{key: flags}),
    ):
        with pytest.warns(UserWarning, match=rf"30 of 60 points are not valid by '{key}'"):
            np.testing.assert_array_equal(PointCloud.of(x).points, P[HALF])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    "others",
    [
        {"scale": 1.0, "offset": np.zeros(3)},
        {"scale": np.random.default_rng(1).random((60, 3))},  # of Gaussians
        {"scale": np.full(60, 0.5), "valid": np.ones(60)},
        {"offset": np.array([60])},  # where the clouds of a batch end
        {"offset": np.array([20, 40, 60])},
        {"mask": np.zeros(60, bool)},
        {"mask": np.ones((4, 5)), "voxel_size": 0.05, "valid": np.array([1, 0])},
        {"scale": "full", "labels": np.arange(60)},
    ],
)
def test_what_changes_no_points_alarms_nobody(others: dict[str, Any], tmp_path: Path) -> None:
    for x in ways(tmp_path, {"points": P, **others}):
        np.testing.assert_array_equal(PointCloud.of(x).points, P)


@pytest.mark.parametrize("key", ["xyz_mm", "coords_mm", "points_mm", "points (mm)", "XYZ_millimeters"])
def test_a_unit_in_the_name_of_the_array_counts(key: str, tmp_path: Path) -> None:
    together = np.zeros(60, [(key, "f8", 3)])
    together[key] = P * 1000
    np.savez(tmp_path / "a.npz", **{key: P * 1000})
    for x in (tmp_path / "a.npz", {key: P * 1000}, together):
        with pytest.warns(UserWarning, match=r"its unit is 0\.001 m"):
            np.testing.assert_allclose(PointCloud.of(x).points, P)


@pytest.mark.parametrize("key", ["colors", "normals", "rgb", "point_normals", "faces", "features", "flow"])
def test_an_archive_without_points_is_refused(key: str, tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", **{key: P})
    with pytest.raises(ValueError, match=rf"has no points: '{key}' is something else by its name"):
        PointCloud.of(tmp_path / "a.npz")
    np.savez(tmp_path / "b.npz", **{key: P[::-1], "scan": P})
    np.testing.assert_array_equal(PointCloud.of(tmp_path / "b.npz").points, P)


def test_two_clouds_without_names_are_refused(tmp_path: Path) -> None:
    for second in (P[:30] + 5.0, P + 5.0):
        np.savez(tmp_path / "a.npz", P, second)
        with np.load(tmp_path / "a.npz") as archive:
            for x in (tmp_path / "a.npz", archive):
                with pytest.raises(ValueError, match=r"holds two clouds, arr_0 \(60, 3\) and arr_1"):
                    PointCloud.of(x)
    unit = P / np.linalg.norm(P, axis=1)[:, None]
    for other in (unit, (unit + 1) / 2, np.arange(90).reshape(30, 3), np.eye(4), np.arange(60.0)):
        np.savez(tmp_path / "b.npz", P, other)
        np.testing.assert_array_equal(PointCloud.of(tmp_path / "b.npz").points, P)
