#!/usr/bin/env bash
# gtsam 4.3.0's `Pose3.Align(a, b)`, `Pose2.Align` and `Similarity3.Align` give the pose that maps b onto a, and scipy 1.17.1's
# `Rotation.align_vectors(a, b)` the rotation that does. Elsewhere in the field the first cloud moves: pycolmap 4.2.1's
# `estimate_rigid3d(a, b)`, and what ICPs take as source and target. Points that are NaN become a pose whose
# rotation is all zeros, without a word.
#
# Guess before it was run: the pose maps the first cloud onto the second, source to target.
# For whom it matters: whoever fits a pose to matched points, markers or targets by gtsam or scipy. The inverse of a small
# motion leaves a residual of twice its size, which looks like poor matches, and not like a mistake of the order.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "gtsam==4.3.0" "scipy==1.17.1" "pycolmap==4.2.1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import gtsam
import numpy as np
import pycolmap
from scipy.spatial.transform import Rotation

a = np.random.default_rng(0).uniform(-5.0, 5.0, (50, 3))
R, t = Rotation.from_euler("z", 20.0, degrees=True), np.array([1.0, 2.0, 0.0])
b = R.apply(a) + t  # the pose from a to b is R, t

full = gtsam.Pose3.Align(a.T, b.T)
flat = gtsam.Pose2.Align(a[:, :2].T, b[:, :2].T)
sized = gtsam.Similarity3.Align(list(zip(a, b, strict=True)))
turn, _ = Rotation.align_vectors(a - a.mean(0), b - b.mean(0))
theirs = pycolmap.estimate_rigid3d(a, b)
yaws = {
    "gtsam Pose3.Align": full.rotation().yaw(),
    "gtsam Pose2.Align": flat.theta(),
    "gtsam Similarity3.Align": sized.rotation().yaw(),
    "scipy align_vectors": turn.as_euler("xyz")[2],
    "pycolmap estimate_rigid3d": Rotation.from_matrix(theirs.rotation.matrix()).as_euler("xyz")[2],
}
print(*(f"{each} {version(each)}" for each in ("gtsam", "scipy", "pycolmap", "numpy")))
for name, yaw in yaws.items():
    print(f"  {name}(a, b): {np.degrees(yaw):+.1f} degrees; from a to b it is +20.0")
hole = gtsam.Pose3.Align(np.vstack([a, [np.nan] * 3]).T, np.vstack([b, [np.nan] * 3]).T).rotation().matrix()
print("  with a point that is NaN the rotation is", hole.tolist())
assert np.allclose(full.transformFrom(b.T).T, a), "gtsam no longer maps b onto a"
signs = [round(float(np.degrees(yaw))) for yaw in yaws.values()]
assert signs == [-20, -20, -20, -20, 20], "gtsam, scipy or pycolmap no longer do this"
assert not hole.any(), "gtsam now tells missing points"
print("maps the second onto the first")
PYTHON
