#!/usr/bin/env bash
# The ICP of opencv-contrib-python-headless 5.0.0.93's surface matching (`cv2.ppf_match_3d_ICP`) returns 0, which stands for
# success, for every pose: also where it ended metres beside the right one, and for clouds of two different places. The residual
# beside it does not tell them apart: that of a pose metres beside the right one may be smaller than that of a right one with
# noise, and of clouds that fit exactly it is 9999999999.
#
# Guess before it was run: another number than 0 where it fails, or the pose that it was given.
# For whom it matters: whoever takes poses by the return value, or the best of several starts by the residual: an exact fit
# loses against all others. Judge the pose by the distances of the moved points from the target.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "opencv-contrib-python-headless==5.0.0.93" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import cv2
import numpy as np

def walls(count, size, at, inwards):
    """Points on the six walls of a box of half that size, with normals (count, 6)."""
    points = random.uniform(-1.0, 1.0, (count, 3)) * size
    wall, side = random.integers(0, 3, count), random.choice([-1.0, 1.0], count)
    points[np.arange(count), wall] = side * size[wall]
    normals = np.zeros_like(points)
    normals[np.arange(count), wall] = inwards * side
    return np.column_stack([points + at, normals])


random = np.random.default_rng(0)
# A room, and a cupboard in one corner, so that it looks like itself in one way only.
cupboard = walls(1000, np.array([3.0, 2.0, 1.5]), [7.0, 6.0, -0.5], 1.0)
source = np.vstack([walls(2000, np.array([10.0, 8.0, 2.0]), [0.0, 0.0, 0.0], -1.0), cupboard]).astype("f4")
elsewhere = np.column_stack([random.uniform(-30.0, 30.0, (3000, 3)), np.tile([0.0, 0.0, 1.0], (3000, 1))]).astype("f4")


def moved(x, noise=0.0):
    target = source.copy()
    target[:, :3] += np.array([x, 0.0, 0.0]) + random.normal(0.0, noise, (3000, 3))
    return target


cases = {
    "one metre away": moved(1.0),
    "one metre away, noise of 0.3 m": moved(1.0, noise=0.3),
    "a hundred metres away": moved(100.0),
    "another place": elsewhere,
    "no distance": source.copy(),
}
print("opencv-contrib-python-headless", version("opencv-contrib-python-headless"), "numpy", np.__version__)
codes, residuals, off = {}, {}, {}
for name, target in cases.items():
    codes[name], residuals[name], pose = cv2.ppf_match_3d_ICP(100).registerModelToScene(source, target)
    found = source[:, :3] @ pose[:3, :3].T + pose[:3, 3]
    off[name] = float(np.linalg.norm(found - target[:, :3], axis=1).mean())
    beside = "" if name == "another place" else f", the points lie {off[name]:.3f} m beside their own"
    print(f"  {name}: returns {codes[name]}, residual {residuals[name]:.3g}{beside}")
assert off["one metre away"] < 1e-3 and off["no distance"] < 1e-3 and off["a hundred metres away"] > 1.0
assert not any(codes.values()), "opencv no longer does this"
assert residuals["no distance"] > 1e9, "opencv no longer does this"
assert residuals["a hundred metres away"] < 2.0 * residuals["one metre away, noise of 0.3 m"], "opencv no longer does this"
print("every pose is a success")
PYTHON
