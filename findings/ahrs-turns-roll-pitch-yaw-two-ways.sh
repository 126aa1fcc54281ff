#!/usr/bin/env bash
# ahrs 0.4.0 makes of `Quaternion(rpy=[roll, pitch, yaw])` and of `DCM(rpy=[roll, pitch, yaw])`, with the same three numbers, two
# rotations: the quaternion turns by the first about x, the matrix by the first about z ("in reverse order", says a note in its
# examples). `DCM.to_rpy` gives back neither: of a matrix that was made of three angles it returns others, and of a yaw of 30 degrees
# alone a roll of -30. `DCM.log` has the opposite sign of the vector that turns so, as its formula is documented.
#
# Guess before it was run: one rotation, that of scipy's "xyz" (that `to_rpy` returns what went in was noted after a first odd output).
# For whom it matters: whoever levels scans by an IMU's angles, or turns a pose into angles and back: heading and roll change places,
# and where all angles are small, as on a road, the result looks like a poor calibration. Build the matrix by the
# quaternion's `to_DCM`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "ahrs==0.4.0" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from ahrs import DCM, Quaternion
from scipy.spatial.transform import Rotation

print("ahrs", version("ahrs"), "scipy", version("scipy"), "numpy", np.__version__)
angles = np.radians([10.0, -20.0, 30.0])  # roll, pitch, yaw
R = Rotation.from_euler("xyz", angles).as_matrix()


def degrees(A):
    return float(np.degrees(Rotation.from_matrix(np.array(A) @ R.T).magnitude()))


off_quaternion, off_matrix = degrees(Quaternion(rpy=angles).to_DCM()), degrees(DCM(rpy=angles))
back = np.degrees(DCM(rpy=angles).to_rpy())
yaw = np.degrees(DCM(rpy=np.radians([0.0, 0.0, 30.0])).to_rpy())
log = DCM(R).log
sense = float(np.array([log[2, 1], log[0, 2], log[1, 0]]) @ Rotation.from_matrix(R).as_rotvec())
print(f"  off scipy's rotation: Quaternion(rpy) {off_quaternion:.1f} degrees, DCM(rpy) {off_matrix:.1f}")
print(f"  DCM(rpy=(10, -20, 30)).to_rpy() is {np.round(back, 1)}, of (0, 0, 30) it is {np.round(yaw, 1)}")
print(f"  DCM.log times the rotation vector: {sense:.2f}")
assert off_quaternion < 1e-9, "ahrs's quaternion now turns otherwise"
assert off_matrix > 20.0, "ahrs's matrix now turns as its quaternion"
assert not np.allclose(back, [10.0, -20.0, 30.0], atol=1.0), "ahrs's to_rpy now gives back what went in"
assert abs(yaw[0] + 30.0) < 1e-6 and abs(yaw[2]) < 1e-6, "ahrs no longer does this"
assert sense < 0.0, "ahrs's log now has the sign of the rotation"
print("roll, pitch and yaw are two rotations in one library")
PYTHON
