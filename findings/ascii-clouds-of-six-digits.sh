#!/usr/bin/env bash
# Open3D 0.20.0 writes PLY in ascii (`write_ascii=True`), of clouds and meshes, legacy and tensor, with six digits of every
# coordinate, under a header that says `double`; OFF files too, and OpenCV 5.0.0's `savePointCloud` its OBJ. A kilometre
# off the origin points move by millimetres; in a map's grid (UTM northings are millions of metres) by metres. Open3D's
# ascii PCD has ten digits, and OpenCV's ascii PLY the nine that its single precision needs. No call says so.
#
# Guess before it was run: text is longer than binary, not coarser: 17 digits, or nine of single precision.
# For whom it matters: whoever picks ascii to look into a file or to pass it on, and registers what was read back. Write
# binary PLY, or `.xyz` with Open3D (ten decimals).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "opencv-contrib-python-headless==5.0.0.93" "numpy<2.5" \
    "libusb-package"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 OPENCV_LOG_LEVEL=OFF "$folder/env/bin/python" - <<'PYTHON'
import ctypes
from importlib.metadata import version

import cv2
import libusb_package
import numpy as np

ctypes.CDLL(libusb_package.get_library_path(), mode=ctypes.RTLD_GLOBAL)
import open3d as o3d


def cloud(path, points, **how):
    assert o3d.io.write_point_cloud(path, o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points)), **how)
    return np.asarray(o3d.io.read_point_cloud(path).points)


def tensor(path, points, **how):
    assert o3d.t.io.write_point_cloud(path, o3d.t.geometry.PointCloud(o3d.core.Tensor(points)), **how)
    return o3d.t.io.read_point_cloud(path).point.positions.numpy()


def mesh(path, points, **how):
    corners = o3d.utility.Vector3iVector(np.arange(len(points) // 3 * 3).reshape(-1, 3))
    assert o3d.io.write_triangle_mesh(path, o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(points), corners), **how)
    return np.asarray(o3d.io.read_triangle_mesh(path).vertices)


def opencv(path, points):
    cv2.savePointCloud(path, points.astype(np.float32).reshape(-1, 1, 3))
    return cv2.loadPointCloud(path)[0].reshape(-1, 3).astype(np.float64)


text = {"write_ascii": True}
ways = {
    "open3d PointCloud, ascii PLY": lambda points: cloud("a.ply", points, **text),
    "open3d t.PointCloud, ascii PLY": lambda points: tensor("b.ply", points, **text),
    "open3d TriangleMesh, ascii PLY": lambda points: mesh("c.ply", points, **text),
    "open3d TriangleMesh, OFF": lambda points: mesh("d.off", points),
    "opencv savePointCloud, OBJ": lambda points: opencv("e.obj", points),
    "open3d PointCloud, binary PLY": lambda points: cloud("f.ply", points),
    "open3d PointCloud, ascii PCD": lambda points: cloud("g.pcd", points, **text),
    "open3d PointCloud, XYZ": lambda points: cloud("h.xyz", points),
    "opencv savePointCloud, ascii PLY": lambda points: opencv("i.ply", points),
}
coarse = list(ways)[:5]
scan = np.random.default_rng(0).uniform(-20.0, 20.0, (300, 3))
places = {"a kilometre off": np.array([1_000.0, 1_000.0, 0.0]), "in a map's grid": np.array([5e5, 5.4e6, 200.0])}
print(*(f"{name} {version(name)}" for name in ("open3d", "opencv-contrib-python-headless")))
for way, write in ways.items():
    moved = []
    for offset in places.values():
        points = (scan + offset).astype(np.float32).astype(np.float64)  # what single precision holds, OpenCV can keep
        moved.append(float(abs(write(points) - points).max()))
    print(f"  {way}: off by up to", ", ".join(f"{each:.2g} m {place}" for each, place in zip(moved, places)))
    if way in coarse:
        assert 0.004 < moved[0] < 0.01 and 4.0 < moved[1] < 10.0, f"{way} has more digits now"
    else:
        assert moved[0] < 1e-5 and moved[1] < 1e-3, f"{way} has fewer digits now"
assert b"property double x" in open("a.ply", "rb").read(200)
print("five of the nine write six digits")
PYTHON
