# SPDX-License-Identifier: MIT
"""Depths and heights that count downwards."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from hybridreg import PointCloud
from hybridreg.io.formats.ply import parse_ply
from hybridreg.io.formats.text import parse_text

P = np.random.default_rng(0).uniform(1.0, 50.0, (60, 3)).round(3)
ROWS = "\n".join(",".join(map(str, row)) for row in P.tolist()) + "\n"


@pytest.mark.parametrize(
    "names",
    [
        "x,y,depth", "X,Y,Depth (m)", "Easting,Northing,Depth", "E,N,D", "North,East,Down", "x,y,z_down",
        "E,N,sounding_m", "x,y,Water Depth",
    ],
)  # fmt: skip
def test_a_depth_is_not_told_to_be_called_z_as_it_is(names: str) -> None:
    pd = pytest.importorskip("pandas")
    fields = [each.replace(" ", "_") for each in names.split(",")]
    head = "".join(f"property float {each}\n" for each in fields)
    ply = f"ply\nformat ascii 1.0\nelement vertex 60\n{head}end_header\n{ROWS.replace(',', ' ')}"
    for read in (
        lambda: parse_text(f"{names}\n{ROWS}".encode(), "cloud"),
        lambda: PointCloud.of(pd.DataFrame(P, columns=names.split(","))),
        lambda: parse_ply(ply.encode(), "cloud"),
    ):
        with pytest.raises(ValueError, match=r"^cloud: .*may count downwards; change its sign and call it z"):
            read()


@pytest.mark.parametrize(
    "head",
    [
        "x,y,z (positive down)", "x,y,Z (depth)", "# x y depth", "# easting, northing, depth", "# z positive down",
        "# vertical: depths, positive downwards", "# Z axis points down", "# depth is positive down",
    ],
)  # fmt: skip
def test_a_z_that_counts_downwards_is_told(head: str) -> None:
    with pytest.warns(UserWarning, match=r"^cloud: its z is said to count downwards.*change the sign of z"):
        np.testing.assert_array_equal(parse_text(f"{head}\n{ROWS}".encode(), "cloud"), P)


def test_an_attribute_of_netcdf_is_told() -> None:
    xr = pytest.importorskip("xarray")
    axes = {key: ("n", values) for key, values in zip("xyz", P.T, strict=True)}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        PointCloud.of(xr.Dataset({**axes, "z": (*axes["z"], {"positive": "up"})}))
    with pytest.warns(UserWarning, match="said to count downwards"):
        PointCloud.of(xr.Dataset({**axes, "z": (*axes["z"], {"positive": "down", "units": "m"})}))


@pytest.mark.parametrize(
    "head",
    [
        "x,y,z,depth", "x,y,z (up)", "# x y z depth", "# x right, y down, z forward", "# z up",
        "Easting,Northing,Height,Depth",
        "# camera: y positive down, z forward", "# 3 m deep, looking down",
        "# z: height; depth is not used, down to 3 m",
    ],
)  # fmt: skip
def test_a_depth_beside_z_says_nothing(head: str) -> None:
    rows = "\n".join(f"{row},1" for row in ROWS.splitlines())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(parse_text(f"{head}\n{rows}\n".encode(), "cloud"), P)
