#!/usr/bin/env bash
# Open3D 0.20.0's `PointCloud.estimate_normals` and small_gicp 1.0.1's `estimate_normals`, both in double precision, sum
# squares of whole coordinates and subtract the square of their mean. In a map's grid (UTM northings are millions of
# metres) almost no digits of a neighbourhood of a metre are left: normals of a flat wall lean by ten degrees, with a finer
# cloud by forty, and are still of length one. Nothing says so. Open3D's tensor clouds (`open3d.t.geometry`), jakteristics
# and point-cloud-utils give the same normals at either place.
#
# Guess before it was run: doubles hold such coordinates to a nanometre, and normals do not depend on where a cloud lies.
# For whom it matters: whoever computes normals or covariances of georeferenced clouds, for a registration from point to
# plane, for GICP, for FPFH or for a map, as it shows in no other way. Move the cloud near the origin first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "small_gicp==1.0.1" "jakteristics==0.6.2" \
    "point-cloud-utils==0.34.0" "numpy<2.5" "libusb-package"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
import ctypes
from importlib.metadata import version

import jakteristics
import libusb_package
import numpy as np
import point_cloud_utils
import small_gicp

ctypes.CDLL(libusb_package.get_library_path(), mode=ctypes.RTLD_GLOBAL)
import open3d as o3d

NEIGHBOURS = 20


def legacy(points):
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
    cloud.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(NEIGHBOURS))
    return np.asarray(cloud.normals)


def tensor(points):
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points))
    cloud.estimate_normals(NEIGHBOURS)
    return cloud.point.normals.numpy()


def gicp(points):
    cloud = small_gicp.PointCloud(points)
    small_gicp.estimate_normals(cloud, small_gicp.KdTree(cloud), NEIGHBOURS, 1)
    return np.asarray(cloud.normals())[:, :3]


def features(points):
    names = ["nx", "ny", "nz"]
    return jakteristics.compute_features(points, search_radius=0.1 * size, feature_names=names, num_threads=1)


def utilities(points):
    return point_cloud_utils.estimate_point_cloud_normals_knn(points, NEIGHBOURS)[1]


ways = {
    "open3d PointCloud": legacy,
    "open3d t.PointCloud": tensor,
    "small_gicp": gicp,
    "jakteristics": features,
    "point-cloud-utils": utilities,
}
rng = np.random.default_rng(0)
normal = np.array([0.3, -0.5, 0.81]) / np.linalg.norm([0.3, -0.5, 0.81])
along = np.cross(normal, [1.0, 0.0, 0.0]) / np.linalg.norm(np.cross(normal, [1.0, 0.0, 0.0]))
places = {"at the origin": np.zeros(3), "in a map's grid": np.array([500_000.0, 5_400_000.0, 200.0])}
print(*(f"{name} {version(name)}" for name in ("open3d", "small_gicp", "jakteristics", "point-cloud-utils")))
lean = {}
for size in (6.0, 1.2):  # of a wall of 4000 points, noise a thousandth of it
    u, v = rng.uniform(-size / 2.0, size / 2.0, (2, 4000))
    wall = np.outer(u, along) + np.outer(v, np.cross(normal, along)) + np.outer(rng.normal(0, size / 3000, 4000), normal)
    inside = np.maximum(abs(u), abs(v)) < 0.4 * size
    print(f"a wall of {size} m, {size / 63:.2f} m from point to point:")
    for name, way in ways.items():
        for place, offset in places.items():
            found = way(wall + offset)[inside]
            assert np.allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-3), f"{name} says now that it cannot tell"
            angles = np.degrees(np.arccos(np.clip(abs(found @ normal), 0.0, 1.0)))
            lean[name, size, place] = float(np.median(angles))
        print(f"  {name}: median error", ", ".join(f"{lean[name, size, place]:.1f} deg {place}" for place in places))
for (name, size, place), angle in lean.items():
    strays = name in ("open3d PointCloud", "small_gicp") and place == "in a map's grid"
    assert angle > (5.0 if size > 2.0 else 20.0) if strays else angle < 1.0, f"{name} no longer does this"
print("two of the five lose the normals of a cloud in a map's grid")
PYTHON
