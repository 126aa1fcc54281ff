#!/usr/bin/env bash
# Open3D 0.20.0: `transform` with a scale in its matrix makes the normals as much longer; `scale` leaves them at length
# one. FPFH takes them as they are, so that features of the same shape no longer match, without a word.
#
# Guess before it was run: normals stay unit vectors either way, and FPFH of a cloud three times as large, with a radius
# three times as large, is the same.
# For whom it matters: whoever brings a photogrammetric model to metres by a similarity and then matches its features.
# `normalize_normals()` after `transform` cures it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "libusb-package"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import ctypes
from importlib.metadata import version

import libusb_package
import numpy as np

ctypes.CDLL(libusb_package.get_library_path(), mode=ctypes.RTLD_GLOBAL)
import open3d as o3d

FACTOR, RADIUS = 3.0, 0.3
similarity = np.diag([FACTOR, FACTOR, FACTOR, 1.0])


def features(cloud, radius):
    search = o3d.geometry.KDTreeSearchParamHybrid(radius, 100)
    return np.asarray(o3d.pipelines.registration.compute_fpfh_feature(cloud, search).data)


# A ring with a wave on it, so that places differ; normals across its surface.
rng = np.random.default_rng(0)
u, v = rng.uniform(0.0, 2.0 * np.pi, (2, 4000))
thick = 0.4 + 0.1 * np.sin(3.0 * u)
points = np.c_[(1.0 + thick * np.cos(v)) * np.cos(u), (1.0 + thick * np.cos(v)) * np.sin(u), thick * np.sin(v)]
normals = np.c_[np.cos(v) * np.cos(u), np.cos(v) * np.sin(u), np.sin(v)]
cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
cloud.normals = o3d.utility.Vector3dVector(normals)
tree = o3d.geometry.KDTreeFlann(features(cloud, RADIUS))

print("open3d", version("open3d"))
found = {}
for name, larger in (
    ("scale", o3d.geometry.PointCloud(cloud).scale(FACTOR, np.zeros(3))),
    ("transform", o3d.geometry.PointCloud(cloud).transform(similarity)),
    ("transform, then normalize_normals", o3d.geometry.PointCloud(cloud).transform(similarity).normalize_normals()),
):
    described = features(larger, FACTOR * RADIUS)
    nearest = [tree.search_knn_vector_xd(described[:, i], 1)[1][0] for i in range(0, len(points), 10)]
    share = float(np.mean(np.array(nearest) == np.arange(0, len(points), 10)))
    length = float(np.linalg.norm(np.asarray(larger.normals), axis=1).mean())
    found[name] = (length, share)
    print(f"{name}: normals of length {length:.2f}; {share:.0%} of the points find themselves by FPFH")

same = "open3d no longer does this"
assert abs(found["scale"][0] - 1.0) < 1e-6 and found["scale"][1] > 0.9, same
assert abs(found["transform"][0] - FACTOR) < 1e-6 and found["transform"][1] < 0.1, same
cured = found["transform, then normalize_normals"]
assert abs(cured[0] - 1.0) < 1e-6 and cured[1] > 0.9, same
PYTHON
