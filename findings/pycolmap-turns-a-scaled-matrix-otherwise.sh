#!/usr/bin/env bash
# pycolmap 4.2.1's `Rigid3d(matrix)` and poselib 2.0.5's `CameraPose.R` make a quaternion of whatever matrix they are given, and length
# one of it. Of a similarity, such as photogrammetry gives, that is no rotation of it and not the nearest one: twice the size turns
# a pose of 44 degrees by 6.7 more, a tenth too small by 1.3, and two digits by 0.13. The translation stays scaled. What comes out is
# a rotation to the last digit, so that no check finds it. pycolmap's `Sim3d(matrix)` takes the same matrix apart rightly.
#
# Guess before it was run: an exception, or the rotation with its scale taken out (noted after a first odd output).
# For whom it matters: whoever brings a reconstruction into a scan's frame by a similarity, or reads matrices with few digits: degrees
# are missing at once, and an ICP begins there. Divide by the cube root of the determinant first, or use an SVD.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pycolmap==4.2.1" "poselib==2.0.5" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import poselib
import pycolmap
from scipy.spatial.transform import Rotation

R = Rotation.from_euler("xyz", [0.2, -0.4, 0.6]).as_matrix()
t = np.array([3.0, -2.0, 1.0])


def degrees(A):
    return float(np.degrees(Rotation.from_matrix(A @ R.T).magnitude()))


def taken(M):
    ours, theirs = pycolmap.Rigid3d(np.c_[M, t]).matrix()[:, :3], poselib.CameraPose()
    theirs.R = M
    exact = max(float(np.abs(A @ A.T - np.eye(3)).max()) for A in (ours, theirs.R))
    return degrees(ours), degrees(theirs.R), exact


print("pycolmap", version("pycolmap"), "poselib", version("poselib"), "numpy", np.__version__)
print(f"  a turn of {np.degrees(Rotation.from_matrix(R).magnitude()):.1f} degrees")
off = {"as it is": taken(R), "twice": taken(2.0 * R), "0.9": taken(0.9 * R), "two digits": taken(np.round(R, 2))}
for words, (ours, theirs, exact) in off.items():
    print(f"  {words}: pycolmap {ours:.2f} degrees off, poselib {theirs:.2f}; R R^T - 1 {exact:.0e}")
similar = pycolmap.Sim3d(np.c_[2.0 * R, t])
print(f"  Sim3d of twice: scale {similar.scale:.3f}, {degrees(similar.rotation.matrix()):.2f} degrees off")
assert off["as it is"][0] < 1e-6 and off["as it is"][1] < 1e-6
assert min(off["twice"][:2]) > 5.0 and min(off["0.9"][:2]) > 1.0, "they now take the scale out"
assert max(each[2] for each in off.values()) < 1e-12, "what they give is no rotation now"
assert degrees(similar.rotation.matrix()) < 1e-6 and abs(similar.scale - 2.0) < 1e-9
print("a scaled matrix becomes another rotation")
PYTHON
