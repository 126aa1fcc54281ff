#!/usr/bin/env bash
# Open3D 0.20.0's `voxel_down_sample` of the legacy clouds begins its grid at the least corner of the cloud: one stray return
# more, or another crop, and nearly every point that is kept is another one. The same call on tensor clouds has its grid at the
# origin of the coordinates, and keeps the same points but for one. Neither description says where the grid lies.
#
# Guess before it was run: cells are multiples of the voxel from the origin, in both.
# For whom it matters: whoever compares thinned clouds, caches features by voxel, thins a map in tiles or chunks, or looks for why
# a registration differs after one point was removed.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "scipy==1.17.1" "numpy<2.5" "libusb-package"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import ctypes

import libusb_package  # open3d's wheel links against libusb without bringing it

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
from importlib.metadata import version

import numpy as np
import open3d as o3d
from scipy.spatial import cKDTree

points = np.random.default_rng(0).uniform(-5.0, 5.0, (5000, 3))
stray = np.vstack([points, [[-5.3, -5.2, -5.4]]])


def legacy(cloud):
    return np.asarray(o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud)).voxel_down_sample(1.0).points)


def tensor(cloud):
    return o3d.t.geometry.PointCloud(cloud).voxel_down_sample(1.0).point.positions.numpy()


print("open3d", version("open3d"), "scipy", version("scipy"), "numpy", np.__version__)
shares = {}
for thin in (legacy, tensor):
    before, after = thin(points), thin(stray)
    shares[thin] = float((cKDTree(after).query(before)[0] < 1e-6).mean())
    print(f"  {thin.__name__}: {len(before)} points, {len(after)} with one more; {100 * shares[thin]:.0f} % are the same")
assert shares[tensor] > 0.99 and shares[legacy] < 0.2, "open3d no longer does this"
print("one point moves all voxels")
PYTHON
