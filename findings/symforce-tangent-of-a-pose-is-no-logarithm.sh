#!/usr/bin/env bash
# symforce 0.12.0's `Pose3.to_tangent` gives the rotation vector and, beside it, the position as it is: its poses are pairs of
# a rotation and a position, not rigid motions. gtsam 4.3.0's `Pose3.Logmap` has the same six numbers in the same order,
# rotation first, and another translation: that of the screw. Half of the one tangent, applied twice, is not the pose; half of
# the other is.
#
# Guess before it was run: the logarithm of a rigid motion, as the name `Pose3` and the order suggest.
# For whom it matters: whoever moves covariances, increments or interpolated poses from one to the other: for a turn by 65
# degrees the translations differ by a third of their length. For small turns the difference grows with the angle.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "symforce==0.12.0" "gtsam==4.3.0" "scipy<1.18" "numpy<2.4"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import gtsam
import numpy as np
import sym
from scipy.linalg import logm
from scipy.spatial.transform import Rotation

R = Rotation.from_rotvec([0.38, -0.01, 1.07]).as_matrix()
T = np.eye(4)
T[:3, :3], T[:3, 3] = R, [1.0, 2.0, 3.0]
screw = logm(T).real
true = np.array([screw[2, 1], screw[0, 2], screw[1, 0], *screw[:3, 3]])
tangents = {
    "symforce": np.asarray(sym.Pose3(R=sym.Rot3.from_rotation_matrix(R), t=T[:3, 3]).to_tangent()),
    "gtsam": np.asarray(gtsam.Pose3.Logmap(gtsam.Pose3(T))),
}
halves = {
    "symforce": np.asarray(sym.Pose3.from_tangent(tangents["symforce"] / 2).to_homogenous_matrix()),
    "gtsam": gtsam.Pose3.Expmap(tangents["gtsam"] / 2).matrix(),
}
print("symforce", version("symforce"), "gtsam", version("gtsam"), "numpy", np.__version__)
print("  logarithm of the matrix:", true.round(3))
off, twice = {}, {}
for name, tangent in tangents.items():
    off[name] = np.abs(tangent - true)
    twice[name] = float(np.linalg.norm((halves[name] @ halves[name] - T)[:3, 3]))
    print(f"  {name}: {tangent.round(3)}; half of it, twice: {twice[name]:.3f} m beside the pose")
assert off["gtsam"].max() < 1e-6 and twice["gtsam"] < 1e-6 and off["symforce"][:3].max() < 1e-6
assert off["symforce"][3:].max() > 0.3 and twice["symforce"] > 0.3, "symforce no longer does this"
print("the same six numbers mean two things")
PYTHON
