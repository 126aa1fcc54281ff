#!/usr/bin/env bash
# aniposelib 0.8.0's `Camera.get_params` holds one focal length, the mean of fx and fy, and of the distortions the first (with
# `extra_dist` two). `set_params` sets all others to zero, so that a camera which takes its own parameters projects elsewhere.
# Bundle adjustment goes through both.
#
# Guess before it was run: a camera is the same after `set_params(get_params())`.
# For whom it matters: whoever brings a calibration with tangential distortion or unlike focal lengths from OpenCV or a camera's
# driver, refines the poses by `bundle_adjust`, and colours or masks a scan with the result: what it sees moves by some pixels.
# `only_extrinsics=True` leaves the lens alone.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "aniposelib==0.8.0" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from aniposelib.cameras import Camera

K = np.array([[600.0, 0.0, 320.0], [0.0, 580.0, 240.0], [0.0, 0.0, 1.0]])
lens = np.array([-0.12, 0.05, 0.004, -0.003, 0.01])  # k1 k2 p1 p2 k3
camera = Camera(matrix=K, dist=lens, size=(640, 480), rvec=np.zeros(3), tvec=np.zeros(3), name="front")
points = np.array([[x, y, 4.0] for x in (-1.8, 0.0, 1.8) for y in (-1.3, 0.0, 1.3)])
before = camera.project(points).reshape(-1, 2)
parameters = camera.get_params()
camera.set_params(parameters)
after = camera.project(points).reshape(-1, 2)
moved = np.linalg.norm(after - before, axis=1)
print("aniposelib", version("aniposelib"))
print("its parameters, pose first:", parameters.round(4))
print("matrix afterwards:", camera.get_camera_matrix().diagonal(), "distortions:", camera.get_distortions())
print(f"pixels of nine points move by {moved.min():.1f} to {moved.max():.1f}")
assert np.allclose(camera.get_distortions(), [lens[0], 0.0, 0.0, 0.0, 0.0])
assert np.isclose(camera.get_camera_matrix()[0, 0], 590.0)
assert moved.max() > 3.0
PYTHON
