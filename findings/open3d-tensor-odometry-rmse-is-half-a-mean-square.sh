#!/usr/bin/env bash
# Open3D 0.20.0's `t.pipelines.odometry.rgbd_odometry_multi_scale` returns `inlier_rmse`, said to be the root of the mean square of
# all inliers, lower being better. It is half the mean square, without the root: two views from one place with noise of 10 mm each, 14 mm
# apart, have an "RMSE" of 0.00008, and noise that is four times as strong makes it about fourteen times as large. With the
# method for colours alone it is not a length at all.
#
# Guess before it was run: metres, as of `inlier_rmse` in the same library's ICP (noted after a first run).
# For whom it matters: whoever accepts a pose by a bound in metres (every pose passes), weighs the edges of a pose graph by it,
# or compares it with the ICP's or with the noise of the camera.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "numpy<2.5" "libusb-package"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import ctypes

import libusb_package  # open3d's wheel links against libusb without bringing it

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
from importlib.metadata import version

import numpy as np
import open3d as o3d

odometry = o3d.t.pipelines.odometry
rng = np.random.default_rng(1)
v, u = np.mgrid[:240, :320] / 100.0
depth = 2.0 + 0.25 * np.sin(2.1 * u + 0.4) * np.cos(1.7 * v) + 0.2 * np.sin(3.0 * v + 1.0) * np.cos(1.1 * u)
grey = (127 + 60 * np.sin(9 * u) * np.cos(7 * v) + 50 * np.sin(4 * u + 5 * v)).clip(0, 255).astype(np.uint8)
intrinsic = o3d.core.Tensor([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]])


def view(noise):
    seen = (depth + rng.normal(0.0, noise, depth.shape)).astype(np.float32)
    colours = np.ascontiguousarray(np.stack([grey] * 3, axis=-1))
    return o3d.t.geometry.RGBDImage(o3d.t.geometry.Image(colours), o3d.t.geometry.Image(seen)), seen


print("open3d", version("open3d"), "numpy", np.__version__)
said, half = {}, {}
for noise in (0.0025, 0.01):
    (source, a), (target, b) = view(noise), view(noise)
    method = odometry.Method.PointToPlane
    found = odometry.rgbd_odometry_multi_scale(source, target, intrinsic, depth_scale=1.0, method=method)
    said[noise], half[noise] = found.inlier_rmse, 0.5 * np.mean((a - b) ** 2)
    apart = np.sqrt(np.mean((a - b) ** 2))
    print(f"  depths {1000 * apart:.1f} mm apart: inlier_rmse {said[noise]:.7f}, half the mean square {half[noise]:.7f}")
assert all(0.5 < said[noise] / half[noise] < 1.5 for noise in said), "inlier_rmse is no longer half a mean square"
assert said[0.01] > 8.0 * said[0.0025], "inlier_rmse is in metres now"
print("Open3D's tensor odometry gives half a mean square as RMSE")
PYTHON
