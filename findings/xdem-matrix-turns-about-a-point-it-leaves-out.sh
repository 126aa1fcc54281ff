#!/usr/bin/env bash
# xdem 0.2.3 gives the pose of a coregistration by `to_matrix()`. For ICP and LZD that matrix turns about a centroid that is
# kept elsewhere (`coreg.meta["outputs"]["affine"]["centroid"]`), not about the origin of the coordinates. Applied as a
# matrix, it leaves points in UTM many kilometres off; xdem's own `apply_matrix` does the same unless it is given the centroid.
# `coreg.apply` uses both, and is right.
#
# Guess before it was run: a 4 x 4 matrix that maps the coordinates that were given, and that `apply_matrix` takes.
# For whom it matters: whoever hands the matrix to another library, or compares it with another pose of the same clouds.
# With the centroid c, the matrix R, t becomes R, c + t - R c. Where there is no rotation, nothing shows.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "xdem==0.2.3" "geoutils==0.2.5" "numpy<2.5" "scipy<1.18" "pandas<3"
cd "$folder"
HOME="$folder" MPLBACKEND=Agg "$folder/env/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import geopandas
import numpy as np
import rasterio
import xdem
from scipy.spatial.transform import Rotation

warnings.simplefilter("ignore")
west, north, cell = 500_000.0, 5_200_000.0, 5.0


def height(x, y):
    """Hills."""
    u, v = (x - west) / 100.0, (y - north) / 100.0
    return 500.0 + 30.0 * np.sin(1.3 * u) + 25.0 * np.cos(1.7 * v + 0.5) + 10.0 * np.sin(3.0 * u + 2.0 * v)


rows, columns = np.mgrid[0:120, 0:120]
ground = height(west + cell * columns, north - cell * rows).astype(np.float32)  # at the corners, as geoutils has it
transform = rasterio.transform.from_origin(west, north, cell, cell)
dem = xdem.DEM.from_array(ground, transform=transform, crs=rasterio.crs.CRS.from_epsg(32632), nodata=-9999)

rng = np.random.default_rng(0)
x, y = west + rng.uniform(50.0, 550.0, 4000), north - rng.uniform(50.0, 550.0, 4000)
truth = np.column_stack([x, y, height(x, y)])
R = Rotation.from_euler("xyz", [1.0, 0.5, 0.3], degrees=True).as_matrix()
tilted = (truth - truth.mean(axis=0)) @ R.T + truth.mean(axis=0) + [3.0, -2.0, 4.0]


def table(points):
    """Points as xdem takes them."""
    return geopandas.GeoDataFrame(
        {"z": points[:, 2]}, geometry=geopandas.points_from_xy(points[:, 0], points[:, 1], crs=32632)
    )


def array(moved):
    """Points as xdem gives them."""
    moved = getattr(moved, "ds", moved)
    return np.column_stack([moved.geometry.x, moved.geometry.y, moved["z"]])


def off(points):
    """How far points lie from the truth, metres."""
    return np.median(np.linalg.norm(points - truth, axis=1))


icp = xdem.coreg.ICP()
icp.fit(dem, table(tilted), z_name="z", random_state=0)
T, centroid = icp.to_matrix(), np.array(icp.meta["outputs"]["affine"]["centroid"])
S = T.copy()
S[:3, 3] += centroid - T[:3, :3] @ centroid
found = {
    "before": off(tilted),
    "coreg.apply": off(array(icp.apply(table(tilted), z_name="z"))),
    "its matrix": off(tilted @ T[:3, :3].T + T[:3, 3]),
    "xdem.coreg.apply_matrix of it": off(array(xdem.coreg.apply_matrix(table(tilted), T, z_name="z"))),
    "the matrix about the centroid": off(tilted @ S[:3, :3].T + S[:3, 3]),
}
print("xdem", version("xdem"), "geoutils", version("geoutils"), "numpy", np.__version__)
for how, metres in found.items():
    print(f"  {how}: {metres:.2f} m from where the points belong")
_, applied, plain, own, about = found.values()
assert applied < 1.5 and abs(about - applied) < 1e-3
assert plain > 10_000.0 and own > 10_000.0, "xdem no longer does this"
print("the matrix alone, also in xdem's own hands, sends the points kilometres away")
PYTHON
