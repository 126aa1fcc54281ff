#!/usr/bin/env bash
# Open3D 0.20.0's `write_pinhole_camera_trajectory` to `.txt`, the form of TUM's trajectories, ends the comment in the first
# line by no line break, so that the first pose stands in the comment. Every reader that skips comments, its own among them,
# finds one pose fewer, and the others one place earlier. The same trajectory comes back whole from `.log` and `.json`.
#
# Guess before it was run: as many poses come back as were written, in each of the three forms.
# For whom it matters: whoever matches poses to images or scans by their order, or scores a trajectory of Open3D's by evo. The
# stamps are the numbers 0, 1, 2 ... of the cameras, so that the missing one shows as a trajectory that begins at 1.
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

lens = o3d.camera.PinholeCameraIntrinsic(640, 480, 500.0, 500.0, 319.5, 239.5)
cameras = []
for k in range(5):
    camera = o3d.camera.PinholeCameraParameters()
    camera.intrinsic, T = lens, np.eye(4)
    T[:3, :3], T[:3, 3] = o3d.geometry.get_rotation_matrix_from_xyz((0.1 * k, 0.2, 0.0)), [k, 2.0, 3.0]
    camera.extrinsic = T
    cameras.append(camera)
trajectory = o3d.camera.PinholeCameraTrajectory()
trajectory.parameters = cameras

print("open3d", version("open3d"), "numpy", np.__version__)
back = {}
for ending in (".log", ".json", ".txt"):
    o3d.io.write_pinhole_camera_trajectory("poses" + ending, trajectory)
    back[ending] = [each.extrinsic for each in o3d.io.read_pinhole_camera_trajectory("poses" + ending).parameters]
    off = [float(np.abs(a - b.extrinsic).max()) for a, b in zip(back[ending], cameras, strict=False)]
    print(f"  {ending}: {len(back[ending])} of {len(cameras)} poses; the k-th is off by {max(off):.3f}")
with open("poses.txt") as file:
    first = file.readline().strip()
print("  first line:", first)
for ending in (".log", ".json"):
    assert len(back[ending]) == 5 and np.allclose(back[ending][4], cameras[4].extrinsic, atol=1e-6)
assert len(back[".txt"]) == 4 and np.allclose(back[".txt"][0], cameras[1].extrinsic, atol=1e-4), "open3d no longer does this"
assert first.startswith("#") and "<qw>0 " in first, "open3d no longer does this"
print("the first pose stands in the comment")
PYTHON
