#!/usr/bin/env bash
# pycolmap 4.2.1's `estimate_rigid3d_robust` and `estimate_sim3d_robust` take the `RANSACOptions` of its estimators for images,
# whose `max_error` of 4 is meant in pixels; between points it is 4 m. In a room nearly every wrong correspondence is an
# inlier then, and is averaged into the pose: a fifth of wrong ones turn it by 13 and 16 degrees, where the others fit to
# a centimetre, and it reports more inliers than there are right ones. With `max_error = 0.05` the pose is right.
#
# Guess before it was run: with its default options it finds the pose.
# For whom it matters: whoever estimates a pose from matched points or features with it. Set `max_error` in the points' own
# unit: `options = pycolmap.RANSACOptions(); options.max_error = 0.05`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pycolmap==4.2.1" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pycolmap

yaw = np.radians(40.0)
R = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
t = np.array([1.0, 2.0, 0.3])
rng = np.random.default_rng(0)
HALF = np.array([2.5, 2.0, 1.25])  # of a room, metres


def off(pose):
    """Degrees and metres from the truth."""
    cosine = (np.trace(pose.rotation.matrix().T @ R) - 1.0) / 2.0
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), np.linalg.norm(pose.translation - t)


source = rng.uniform(-HALF, HALF, (500, 3))
target = source @ R.T + t + rng.normal(0.0, 0.01, source.shape)
wrong = np.arange(500) < 100
target[wrong] = rng.uniform(-HALF, HALF, (100, 3)) @ R.T + t
options = pycolmap.RANSACOptions()
options.random_seed = 0
near = pycolmap.RANSACOptions()
near.random_seed, near.max_error = 0, 0.05
print("pycolmap", version("pycolmap"), "numpy", np.__version__)
print(f"  max_error unless told: {options.max_error}")
seen = {}
for name in ("estimate_rigid3d_robust", "estimate_sim3d_robust"):
    estimate = getattr(pycolmap, name)
    for words, each in (("as it is", options), ("0.05", near)):
        found = estimate(source, target, each)
        degrees, metres = off(found["tgt_from_src"])
        seen[name, words] = degrees, metres, found["num_inliers"]
        print(f"  {name}, max_error {words}: {degrees:.2f} deg and {metres:.3f} m off, {found['num_inliers']} inliers of 400 right")
for name in ("estimate_rigid3d_robust", "estimate_sim3d_robust"):
    degrees, metres, inliers = seen[name, "0.05"]
    assert degrees < 0.2 and metres < 0.01 and 390 <= inliers <= 410
    degrees, metres, inliers = seen[name, "as it is"]
    assert inliers > 430, "pycolmap no longer takes four metres"
assert seen["estimate_rigid3d_robust", "as it is"][0] > 2.0, "pycolmap no longer does this"
assert options.max_error == 4.0
print("four pixels are four metres here")
PYTHON
