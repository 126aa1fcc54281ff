#!/usr/bin/env bash
# opencv-python-headless 5.0.0.93: `cv2.depthTo3d` makes NaN of a missing depth (0) in a uint16 image, and a point exactly
# at the camera in an image of int16 or of floats. The same picture in millimetres and in metres thus gives two clouds: one
# with holes, one with a heap of points at the origin. Where floats mark missing depths by NaN, they stay NaN.
#
# Guess before it was run: what has no depth is NaN, whatever the type; it is for uint16.
# For whom it matters: whoever divides the depths of a RealSense or a Kinect by 1000 first, and then drops what is not
# finite: a fifth of the points may be one point, which draws centroids, voxels and nearest neighbours.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "opencv-python-headless==5.0.0.93" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import cv2
import numpy as np

K = np.array([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]])
millimetres = np.full((240, 320), 2000, np.uint16)
millimetres[:, :64] = 0  # a fifth without a depth
metres = millimetres / 1000.0
images = {
    "uint16, millimetres": millimetres,
    "int16, millimetres": millimetres.astype(np.int16),
    "float32, metres": metres.astype(np.float32),
    "float64, metres": metres,
    "float32, metres, NaN where missing": np.where(metres == 0.0, np.nan, metres).astype(np.float32),
}
print("opencv-python-headless", version("opencv-python-headless"), "numpy", np.__version__)
counts = []
for kind, image in images.items():
    points = cv2.depthTo3d(image, K)[..., :3].reshape(-1, 3)
    missing, heap = np.isnan(points).any(axis=1).sum(), (points == 0.0).all(axis=1).sum()
    middle = np.nanmean(points, axis=0)
    counts.append((int(missing), int(heap)))
    print(f"  {kind}: {missing} NaN, {heap} at the camera, finite points have their mean at {np.round(middle, 2)}")
holes = 240 * 64
assert counts == [(holes, 0), (0, holes), (0, holes), (0, holes), (holes, 0)], "opencv no longer does this"
print("without a depth, a pixel becomes NaN or the camera's place, by the type of the image")
PYTHON
