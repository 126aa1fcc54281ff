# SPDX-License-Identifier: MIT
"""x, y and z whose dimensions have names: xarray's and netCDF4's."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from hybridreg.cloud import PointCloud

P = np.random.default_rng(5).uniform(-5.0, 5.0, (60, 3))
GRID = P.reshape(6, 10, 3)
xr = pytest.importorskip("xarray")


def same(x: Any) -> None:
    np.testing.assert_array_equal(PointCloud.of(x, name="target").points, P)


def refused(x: Any) -> str:
    with pytest.raises(ValueError, match="^target: ") as told:
        PointCloud.of(x, name="target")
    return str(told.value)


def coordinates(table: Any = P, dims: Any = "n") -> dict[str, Any]:
    return {axis: (dims, table[..., k]) for k, axis in enumerate("xyz")}


def test_a_dataset_may_hold_its_points_as_coordinates() -> None:
    # As xradar 0.12.0's georeference leaves them; such were refused: "has 0 fields called 'x'".
    same(xr.Dataset({"intensity": ("n", P[:, 0])}, coords=coordinates()))
    same(
        xr.Dataset(
            {"dBZ": (("ring", "azimuth"), GRID[..., 0])}, coords=coordinates(GRID, ("ring", "azimuth"))
        )
    )
    same(xr.Dataset({"z": ("n", P[:, 2])}, coords={axis: ("n", P[:, k]) for k, axis in enumerate("xy")}))
    same(xr.Dataset({"y": ("x", P[:, 1]), "z": ("x", P[:, 2])}, coords={"x": P[:, 0]}))
    same(xr.DataArray(P[:, 0], dims="n", coords=coordinates()))


def test_variables_called_so_come_before_coordinates_called_so() -> None:
    pixels = {"x": ("col", np.arange(10.0)), "y": ("row", np.arange(6.0))}
    named = {axis: (("row", "col"), GRID[..., k]) for k, axis in enumerate("XYZ")}
    same(xr.Dataset(named, coords=pixels))


def turned(axis: str) -> Any:
    variables = coordinates(GRID, ("ring", "azimuth"))
    dims, values = variables[axis]
    return {**variables, axis: (dims[::-1], values.T)}


@pytest.mark.parametrize("axis", "xyz")
def test_dimensions_in_another_order_are_turned(axis: str) -> None:
    # Cell after cell, each x had the z of another point, in silence.
    expected = xr.Dataset(turned(axis))
    assert sorted(map(tuple, PointCloud.of(expected, name="target").points)) == sorted(map(tuple, P))
    same(xr.Dataset(turned("z")))
    same(xr.Dataset({"dBZ": (("ring", "azimuth"), GRID[..., 0])}, coords=turned("z")))
    same(xr.DataArray(GRID[..., 0], dims=("ring", "azimuth"), coords=turned("z")))


def test_dimensions_of_netcdf_count_too() -> None:
    # netCDF4 1.7.5 calls them `dimensions`.
    class Variable(np.ndarray):
        dimensions: tuple[str, ...]

    def variable(values: Any, *dims: str) -> Any:
        held = np.asarray(values).view(Variable)
        held.dimensions = dims
        return held

    table = {axis: variable(GRID[..., k], "ring", "azimuth") for k, axis in enumerate("xyz")}
    same(table)
    same({**table, "z": variable(GRID[..., 2].T, "azimuth", "ring")})
    lone = {axis: variable(P[:, k], axis) for k, axis in enumerate("xyz")}
    assert "xarray.open_dataset(path).to_dataframe().reset_index()" in refused(lone)


def test_axes_of_a_grid_are_no_points_of_its_diagonal() -> None:
    # Three axes of equal length were read as so many points.
    grid = xr.Dataset({axis: (f"{axis}_dim", P[:20, k]) for k, axis in enumerate("xyz")})
    told = refused(grid)
    assert "(x_dim); (y_dim); (z_dim)" in told
    assert "x.to_dataframe().reset_index()" in told
    assert len(PointCloud.of(grid.to_dataframe().reset_index())) == 8000  # what it says works
    heights = xr.DataArray(
        np.zeros((6, 10)),
        dims=("row", "col"),
        coords={"x": ("col", P[:10, 0]), "y": ("row", P[:6, 1]), "z": (("row", "col"), GRID[..., 2])},
    )
    assert 'x.to_dataframe("value").reset_index()' in refused(heights)
    cloud = PointCloud.of(heights.to_dataframe("value").reset_index())
    np.testing.assert_array_equal(cloud.points[:, 2], P[:, 2])


def test_dimensions_without_names_change_nothing() -> None:
    # h5py's data sets have `dims` of another kind.
    class Held(np.ndarray):
        dims = SimpleNamespace(label="")

    same({axis: P[:, k].view(Held) for k, axis in enumerate("xyz")})
