#!/usr/bin/env bash
# Open3D 0.20.0 has two kinds of clouds, legacy and tensor. `remove_radius_outlier(n, r)` of the first keeps points that
# have more than n points within the radius, themselves counted; `remove_radius_outliers(n, r)` of the second those that
# have n or more, so that an eighth more points remain here. Both descriptions say that points with fewer than n are
# removed. `voxel_down_sample` of the first lays its grid by the corner of the cloud, that of the second by the origin:
# one stray point far away moves most of what the first returns, and nothing of the second's. Statistical outliers and
# clusters agree.
#
# Guess before it was run: the same arguments give the same points with both kinds.
# For whom it matters: whoever goes from one kind to the other with thresholds that were tuned, or compares thinned clouds
# point by point. n + 1 with a tensor cloud does what n does with a legacy one.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "scipy==1.17.1" "numpy<2.5" "libusb-package"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
import ctypes
from importlib.metadata import version

import libusb_package
import numpy as np
from scipy.spatial import cKDTree

ctypes.CDLL(libusb_package.get_library_path(), mode=ctypes.RTLD_GLOBAL)
import open3d as o3d

LEAST, RADIUS, VOXEL = 6, 0.5, 0.5


def legacy(points):
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))


def tensor(points):
    return o3d.t.geometry.PointCloud(o3d.core.Tensor(points))


def thinned(points):
    """What both kinds return, legacy first."""
    one = np.asarray(legacy(points).voxel_down_sample(VOXEL).points)
    return one, tensor(points).voxel_down_sample(VOXEL).point.positions.numpy()


def stays(before, after):
    """Share of the points that are there again, to a micron."""
    return float(np.mean(cKDTree(after).query(before)[0] < 1e-6))


rng = np.random.default_rng(0)
points = np.vstack([rng.normal(size=(2000, 3)) * [4.0, 4.0, 0.1], rng.uniform(-10.0, 10.0, (100, 3))])
counts = np.array([len(each) for each in cKDTree(points).query_ball_point(points, RADIUS)])  # itself too
kept = {
    "legacy": np.sort(np.asarray(legacy(points).remove_radius_outlier(LEAST, RADIUS)[1])),
    "tensor": np.flatnonzero(tensor(points).remove_radius_outliers(LEAST, RADIUS)[1].numpy()),
    "tensor, one more": np.flatnonzero(tensor(points).remove_radius_outliers(LEAST + 1, RADIUS)[1].numpy()),
}
print("open3d", version("open3d"), "scipy", version("scipy"), "numpy", version("numpy"))
print(f"outliers by {LEAST} points within {RADIUS} m, of {len(points)} points:")
for name, rows in kept.items():
    print(f"  {name}: {len(rows)} remain")
stray = points.min(axis=0) - [3.21, 2.34, 1.23]
shares = [stays(before, after) for before, after in zip(thinned(points), thinned(np.vstack([points, stray])))]
print(f"thinned by {VOXEL} m, with a stray point added: {shares[0]:.0%} of the legacy points stay, {shares[1]:.0%} of the tensor's")

same = "open3d no longer does this"
assert np.array_equal(kept["legacy"], np.flatnonzero(counts > LEAST)), same
assert np.array_equal(kept["tensor"], np.flatnonzero(counts >= LEAST)), same
assert np.array_equal(kept["tensor, one more"], kept["legacy"]) and len(kept["tensor"]) > 1.1 * len(kept["legacy"]), same
assert shares[0] < 0.5 and shares[1] == 1.0, same
print("the same numbers keep other points")
PYTHON
