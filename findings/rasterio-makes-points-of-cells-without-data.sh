#!/usr/bin/env bash
# rasterio 1.4.4, with the GDAL 3.10.3 in its wheel, writes a raster of heights as XYZ text with a row for each cell, also for
# those that the raster says have no data: their height is the number that stands for that, -9999 or another. Nothing in the
# text tells which number that was. The rows lie at the middles of the cells.
#
# Guess before it was run: cells without data are left out.
# For whom it matters: whoever turns an elevation model into a cloud with it, or with `gdal_translate -of XYZ`: some of the
# points lie ten kilometres below the others, draw the middle of the cloud there and stretch its box. Leave out the rows with
# the number in `dataset.nodata`, or take `dataset.read(1, masked=True)`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "rasterio==1.4.4" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import numpy as np
import rasterio
import rasterio.shutil
from rasterio.transform import from_origin

heights = np.random.default_rng(0).uniform(100.0, 110.0, (30, 40)).astype("f4")
heights[:5] = -9999.0
grid = from_origin(500_000.0, 5_400_000.0, 1.0, 1.0)
shape = {"height": 30, "width": 40, "count": 1, "dtype": "float32"}
with rasterio.open("dem.tif", "w", driver="GTiff", transform=grid, nodata=-9999.0, **shape) as file:
    file.write(heights, 1)
rasterio.shutil.copy("dem.tif", "dem.xyz", driver="XYZ")
points = np.loadtxt("dem.xyz")
with rasterio.open("dem.tif") as file:
    filled = int((~file.read(1, masked=True).mask).sum())
empty = int((points[:, 2] == -9999.0).sum())
print("rasterio", rasterio.__version__, "GDAL", rasterio.__gdal_version__, "numpy", np.__version__)
print(f"  {heights.size} cells, {filled} with data; {len(points)} rows of text, {empty} of them at -9999")
print(f"  the first cell's corner is (500000, 5400000), the first row {points[0]}; mean height {points[:, 2].mean():.0f} m")
assert filled == 1000 and points[0, 0] == 500_000.5
assert len(points) == 1200 and empty == 200, "GDAL no longer does this"
print("no data become points")
PYTHON
