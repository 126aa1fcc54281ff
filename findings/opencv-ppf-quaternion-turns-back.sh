#!/usr/bin/env bash
# A pose of opencv-contrib-python-headless 5.0.0.93's surface matching (`cv2.ppf_match_3d_Pose3D`) holds its rotation twice: in the
# matrix `pose` and as a quaternion `q`, w first. The quaternion is that of the inverse. Set by `updatePoseQuat`, a quaternion gives the
# matrix of its inverse too, so that the class agrees with itself and with nothing else. The angle beside them and the translation
# are the same either way.
#
# Guess before it was run: `q` turns as the matrix beside it does (noted after a first odd output).
# For whom it matters: whoever passes found poses on as a position and a quaternion, to ROS or to a robot, or sets a start by one: turns
# of a few degrees are wrong by twice as many, about which an ICP says nothing. Make the quaternion of the matrix.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "opencv-contrib-python-headless==5.0.0.93" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import cv2
import numpy as np
from scipy.spatial.transform import Rotation

turn = Rotation.from_euler("xyz", [5.0, -10.0, 30.0], degrees=True)
T = np.eye(4)
T[:3, :3], T[:3, 3] = turn.as_matrix(), [0.5, 0.3, 2.0]
held = cv2.ppf_match_3d_Pose3D()
held.updatePose(T)
w, x, y, z = held.q
read = Rotation.from_quat([x, y, z, w])
x, y, z, w = turn.as_quat()
written = cv2.ppf_match_3d_Pose3D()
written.updatePoseQuat(np.array([w, x, y, z]), T[:3, 3])
made = Rotation.from_matrix(written.pose[:3, :3])


def degrees(other):
    return float(np.degrees((other * turn.inv()).magnitude()))


print("opencv", cv2.__version__, "numpy", np.__version__)
print(f"  a turn of {np.degrees(turn.magnitude()):.1f} degrees: its matrix is {degrees(Rotation.from_matrix(held.pose[:3, :3])):.1f} off")
print(f"  q is {degrees(read):.1f} off, its inverse {degrees(read.inv()):.1f}")
print(f"  the matrix that updatePoseQuat makes is {degrees(made):.1f} off, its inverse {degrees(made.inv()):.1f}")
assert degrees(Rotation.from_matrix(held.pose[:3, :3])) < 1e-6
assert degrees(read.inv()) < 1e-6 and degrees(made.inv()) < 1e-6, "opencv's quaternion is another now"
assert degrees(read) > 30.0 and degrees(made) > 30.0, "opencv's quaternion now turns as its matrix"
print("the quaternion of a pose turns back")
PYTHON
