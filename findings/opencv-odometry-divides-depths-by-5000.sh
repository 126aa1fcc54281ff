#!/usr/bin/env bash
# opencv-python-headless 5.0.0.93: `cv2.Odometry` takes depths for metres, unless one of them exceeds 10: then it divides
# all by 5000, as the TUM data sets count, whatever their type. Depths in millimetres, as Kinect and RealSense give them,
# therefore give the right rotation and a fifth of the translation; depths in metres give next to no translation as soon as
# one pixel sees farther than 10 m. It answers True each time. `cv2.depthTo3d` of the same image divides uint16 by 1000.
#
# Guess before it was run: uint16 counts millimetres and floats metres, as `depthTo3d` documents it.
# For whom it matters: whoever takes its pose as a start or compares it with a pose of clouds that `depthTo3d` made of the
# same images. Give floats in metres, with what is farther than 10 m set to 0.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "opencv-python-headless==5.0.0.93" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import cv2
import numpy as np

K = np.array([[300.0, 0.0, 159.5], [0.0, 300.0, 119.5], [0.0, 0.0, 1.0]], np.float32)
u, v = np.meshgrid(np.arange(320.0), np.arange(240.0))
rays = np.stack([(u - 159.5) / 300.0, (v - 119.5) / 300.0, np.ones_like(u)], axis=-1)


def depths(R, t):
    """What a camera at t, turned by R, sees of the walls of a room and of a ball, metres."""
    ray, nearest = rays @ R.T, np.full(u.shape, np.inf)
    for axis, wall in ((0, -1.5), (0, 1.2), (1, -0.8), (1, 0.7), (2, 3.0)):
        with np.errstate(all="ignore"):
            along = (wall - t[axis]) / ray[..., axis]
        nearest = np.where((along > 0.0) & (along < nearest), along, nearest)
    square, towards = (ray**2).sum(axis=-1), ray @ (t - [0.25, 0.2, 2.0])
    inside = towards**2 - square * (((t - [0.25, 0.2, 2.0]) ** 2).sum() - 0.3**2)
    ball = (-towards - np.sqrt(np.maximum(inside, 0.0))) / square
    return np.where((inside > 0.0) & (ball < nearest), ball, nearest)


def moved(first, second):
    """Degrees and metres of the second camera in the first one's frame, as the odometry of depths has them."""
    settings = cv2.OdometrySettings()
    settings.setCameraMatrix(K)
    odometry = cv2.Odometry(cv2.OdometryType_DEPTH, settings, cv2.OdometryAlgoType_COMMON)
    frames = cv2.OdometryFrame(depth=first), cv2.OdometryFrame(depth=second)
    odometry.prepareFrames(*frames)
    found, T = odometry.compute(*frames)
    assert found
    turn = np.degrees(np.arccos((np.trace(T[:3, :3]) - 1.0) / 2.0))
    return turn, np.linalg.norm(T[:3, 3])


turned = cv2.Rodrigues(np.radians([0.0, 1.0, 0.0]))[0]
a, b = depths(np.eye(3), np.zeros(3)), depths(turned, np.array([0.04, 0.0, 0.03]))
far_a, far_b = a.copy(), b.copy()
far_a[0, 0] = far_b[0, 0] = 10.1
answers = {
    "floats, metres": moved(a.astype(np.float32), b.astype(np.float32)),
    "floats, metres, one pixel at 10.1": moved(far_a.astype(np.float32), far_b.astype(np.float32)),
    "uint16, millimetres": moved(np.round(1000 * a).astype(np.uint16), np.round(1000 * b).astype(np.uint16)),
    "uint16, 5000 a metre": moved(np.round(5000 * a).astype(np.uint16), np.round(5000 * b).astype(np.uint16)),
}
depth = cv2.depthTo3d(np.full((2, 2), 1000, np.uint16), np.eye(3))[0, 0, 2]
print("opencv-python-headless", version("opencv-python-headless"), "numpy", np.__version__)
print(f"  the camera turned by 1 deg and moved by {np.hypot(0.04, 0.03):.4f} m, depths are below {a.max():.1f} m")
for kind, (turn, way) in answers.items():
    print(f"  {kind}: {turn:.2f} deg, {way:.4f} m")
print(f"  depthTo3d puts a uint16 depth of 1000 at {depth:.1f} m")
turns, ways = np.array(list(answers.values())).T
assert np.allclose(turns[[0, 2, 3]], 1.0, atol=0.05) and depth == 1.0
assert np.allclose(ways, [0.05, 0.0, 0.01, 0.05], atol=1e-3), "opencv no longer does this"
print("in millimetres the motion is a fifth of what it was; one pixel beyond 10 m ends it")
PYTHON
