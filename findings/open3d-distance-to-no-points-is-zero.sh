#!/usr/bin/env bash
# Open3D 0.20.0's `compute_point_cloud_distance` to a cloud without points gives 0 for every point, as if the clouds lay
# exactly on each other, after a warning on the console. `registration_icp` of the same pair has fitness 0 and an RMSE of 0,
# and hands back the pose that it was given. scipy's KD-tree gives infinite distances.
#
# Guess before it was run: infinite distances, or an error.
# For whom it matters: whoever crops the target to the overlap, or filters it, and takes the mean of the distances, or the share
# below a threshold, for a score: of all poses those win where nothing is left of the target.
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

points = np.random.default_rng(0).uniform(-5.0, 5.0, (1000, 3))
source = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
far = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points + [100.0, 0.0, 0.0]))
box = o3d.geometry.AxisAlignedBoundingBox([-5.0, -5.0, -5.0], [5.0, 5.0, 5.0])
print("open3d", version("open3d"), "scipy", version("scipy"), "numpy", np.__version__)
means = {}
for name, target in (("a cloud 100 m away", far), ("what a crop leaves of it", far.crop(box))):
    distances = np.asarray(source.compute_point_cloud_distance(target))
    tree = cKDTree(np.asarray(target.points)).query(points)[0]
    found = o3d.pipelines.registration.registration_icp(source, target, 1.0)
    means[name] = distances.mean()
    print(f"  {name}, {len(target.points)} points: {len(distances)} distances, mean {means[name]:.2f}, by scipy {tree.mean():.2f}")
    print(f"    ICP: fitness {found.fitness:.2f}, RMSE {found.inlier_rmse:.2f}")
    assert found.fitness == 0.0 and found.inlier_rmse == 0.0
assert means["a cloud 100 m away"] > 80.0
assert len(distances) == 1000 and not distances.any() and np.isinf(tree).all(), "open3d no longer does this"
print("nothing is nearer than everything")
PYTHON
