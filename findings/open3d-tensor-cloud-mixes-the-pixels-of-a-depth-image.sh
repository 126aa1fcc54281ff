#!/usr/bin/env bash
# Open3D 0.20.0's tensor `PointCloud.create_from_depth_image` gives the points in an order of its threads, another one at each
# call, while the older `PointCloud.create_from_depth_image`, and the tensor one with `with_normals=True`, go row by row.
#
# Guess before it was run: none was noted; a script that took the order for granted failed, and the order was looked at then.
# For whom it matters: whoever gives the points labels, confidences or features by the image's pixels, or makes rows and columns
# of them again (`reshape(height, width, 3)`): the neighbours are wrong, and no two runs agree. Project the points, or set
# `with_normals=True`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "numpy<2.5" "libusb-package"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=4 "$folder/env/bin/python" - <<'PYTHON'
import ctypes

import libusb_package  # open3d's wheel links against libusb without bringing it

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
from importlib.metadata import version

import numpy as np
import open3d as o3d

WIDE, HIGH = 640, 480
K = np.array([[400.0, 0.0, 320.0], [0.0, 400.0, 240.0], [0.0, 0.0, 1.0]])
u = np.arange(WIDE)
depth = np.tile(3.0 / (1.0 - 0.6 * (u - 320.0) / 400.0), (HIGH, 1)).astype(np.float32)
camera = o3d.camera.PinholeCameraIntrinsic(WIDE, HIGH, 400.0, 400.0, 320.0, 240.0)


def in_place(points):
    """Share of the points whose row is that of their pixel."""
    points = np.asarray(points, np.float64)
    pixel = np.round(points[:, :2] / points[:, 2:] * 400.0 + [320.0, 240.0]).astype(int)
    return float(np.mean(pixel[:, 1] * WIDE + pixel[:, 0] == np.arange(len(points))))


def tensor(with_normals):
    """The points of a tensor cloud."""
    image = o3d.t.geometry.Image(o3d.core.Tensor(depth))
    make = o3d.t.geometry.PointCloud.create_from_depth_image
    cloud = make(image, o3d.core.Tensor(K), depth_scale=1.0, depth_max=50.0, with_normals=with_normals)
    return cloud.point.positions.numpy().copy()


print("open3d", version("open3d"), "numpy", np.__version__)
older = o3d.geometry.PointCloud.create_from_depth_image(
    o3d.geometry.Image(depth), camera, depth_scale=1.0, depth_trunc=50.0
).points
runs = [tensor(False) for _ in range(5)]
assert all(len(each) == WIDE * HIGH for each in runs)
shares = [in_place(each) for each in runs]
print(f"  in their pixel's row: of the older cloud {in_place(older):.0%}; of the tensor one {[f'{each:.0%}' for each in shares]}")
same = [np.array_equal(runs[0], each) for each in runs[1:]]
print(f"  two calls with the same image agree: {any(same)}; in the set of their points: {all(np.array_equal(np.unique(runs[0], axis=0), np.unique(each, axis=0)) for each in runs)}")
assert in_place(older) == 1.0
assert min(shares) < 0.9 and not all(same), "open3d no longer does this"
print("the same points, in no order")
PYTHON
