#!/usr/bin/env bash
# pyrealsense2 2.59.1: `rs2_deproject_pixel_to_point` leaves the coefficients of the lens models `modified_brown_conrady`
# and `ftheta` out, or inverts them only roughly, without a word, while `rs2_project_point_to_pixel` applies them. So a
# point that was made of a pixel is projected beside that pixel: by four pixels at the edge of this image, at the first
# model. With the other four models it comes back to a thousandth of a pixel.
#
# Guess before it was run: one of the two may be slow or rough for `inverse_brown_conrady`; with every other model one
# undoes the other.
# For whom it matters: whoever makes a cloud of a depth image with the intrinsics of the camera's stream and registers it,
# or looks up its colours: the cloud is bent as the lens bends. Undistort the image first, or test the model by a pixel
# and back.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyrealsense2==2.59.1.11053" "libusb-package==1.0.30.0" "numpy<2.5"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import ctypes
from importlib.metadata import version

import libusb_package  # stands in for the system's, which the wheel needs
import numpy as np

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
import pyrealsense2 as rs

print("pyrealsense2", version("pyrealsense2"))
lens = rs.intrinsics()
lens.width, lens.height, lens.ppx, lens.ppy, lens.fx, lens.fy = 640, 480, 320.0, 240.0, 600.0, 600.0
lens.coeffs = [0.12, -0.25, 0.001, -0.002, 0.08]
pixel = [560.0, 400.0]
off, bare = {}, None
for name in ("none", "brown_conrady", "inverse_brown_conrady", "kannala_brandt4", "modified_brown_conrady", "ftheta"):
    lens.model = getattr(rs.distortion, name)
    point = rs.rs2_deproject_pixel_to_point(lens, pixel, 1.0)
    bare = bare or point
    off[name] = float(np.linalg.norm(np.subtract(rs.rs2_project_point_to_pixel(lens, point), pixel)))
    same = " (the point of a pinhole camera)" if name != "none" and np.allclose(point, bare, atol=1e-7) else ""
    print(f"{name}: point {np.round(point, 4).tolist()}{same}, projected {off[name]:.3f} pixels beside its own")
    assert bool(same) == (name == "modified_brown_conrady")
assert max(off[name] for name in ("none", "brown_conrady", "inverse_brown_conrady", "kannala_brandt4")) < 1e-3
assert 3.5 < off["modified_brown_conrady"] < 4.5 and 1.0 < off["ftheta"] < 2.0
PYTHON
