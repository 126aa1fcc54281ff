#!/usr/bin/env bash
# geoutils 0.2.5 takes the value of a raster's cell to hold at the cell's upper left corner where the file says
# AREA_OR_POINT=Area, which GDAL and rasterio take for the value of the cell, at its middle. `Raster.to_pointcloud`,
# `coords` and `interp_points` therefore lie half a cell west and north of what rasterio says: 2.5 m each for a DEM of 5 m.
# So does what is built upon it, such as coregistration of points with a DEM by xdem. `force_pixel_offset="center"` of
# `to_pointcloud` gives the middles.
#
# Guess before it was run: the points of a DEM lie in the middles of its cells, as `rasterio.transform.xy` has them.
# For whom it matters: whoever makes a cloud of a DEM to register a scan with it: the pose is off by half a cell.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "geoutils==0.2.5" "rasterio==1.4.4" "numpy<2.5" "pandas<3"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import geoutils
import numpy as np
import rasterio

warnings.simplefilter("ignore")
west, north, cell = 500_000.0, 5_200_000.0, 5.0


def height(x, y):
    """A plane that falls to the west and the south."""
    return 100.0 + (x - west) + 0.5 * (y - north)


transform = rasterio.transform.from_origin(west, north, cell, cell)
rows, columns = np.mgrid[0:40, 0:40]
middles = [np.reshape(each, (40, 40)) for each in rasterio.transform.xy(transform, rows.ravel(), columns.ravel())]
layout = {"driver": "GTiff", "width": 40, "height": 40, "count": 1, "dtype": "float64", "crs": "EPSG:32632"}
with rasterio.open("dem.tif", "w", transform=transform, **layout) as file:
    file.write(height(*middles), 1)
with rasterio.open("dem.tif") as file:
    tag = file.tags()["AREA_OR_POINT"]

dem = geoutils.Raster("dem.tif")


def points(**how):
    """The raster as x, y and z (N, 3)."""
    table = dem.to_pointcloud(data_column_name="z", **how).ds
    return np.column_stack([table.geometry.x, table.geometry.y, table["z"]])


first = np.array([middles[0][0, 0], middles[1][0, 0]])
off = {"as it is": points()[0, :2] - first, "center": points(force_pixel_offset="center")[0, :2] - first}
x, y = np.array([west + 100.0, west + 120.0]), np.array([north - 100.0, north - 60.0])
between = np.asarray(dem.interp_points((x, y), as_array=True)).ravel()
print("geoutils", version("geoutils"), "rasterio", version("rasterio"), "numpy", np.__version__)
print(f"  a DEM of {cell} m cells, AREA_OR_POINT={tag}")
for how, step in off.items():
    print(f"  to_pointcloud, {how}: its first point is {step} m from the middle of the first cell")
print(f"  interp_points: heights {between - height(x, y)} m off")
assert tag == "Area" and np.allclose(off["center"], 0.0)
assert np.allclose(off["as it is"], [-2.5, 2.5]), "geoutils no longer does this"
assert np.allclose(between - height(x, y), 2.5 - 0.5 * 2.5), "geoutils no longer does this"
print("the points of a DEM lie half a cell to the north-west")
PYTHON
