#!/usr/bin/env bash
# vcd 6.0.3, the tools of ASAM OpenLABEL, has `utils.R2rvec`. An rvec is OpenCV's word for a rotation vector, an axis as long as the
# angle, and that is what OpenCV and vcd's cameras take under this name. `R2rvec` gives roll, pitch and yaw, without a description.
# About one axis of the sensor the two agree; a camera that looks ahead, seen from a vehicle, is off by tens of degrees.
#
# Guess before it was run: what `cv2.Rodrigues` gives of the matrix (the source was read before it was run).
# For whom it matters: whoever hands a pose from a labelled file on to OpenCV (`projectPoints`, `solvePnP` with a guess) or to a
# registration as a rotation vector: points are laid elsewhere. Use `cv2.Rodrigues`, or scipy's `Rotation.from_matrix(R).as_rotvec()`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "vcd==6.0.3" "opencv-python==5.0.0.93" "numpy<2.4" "scipy<1.18"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import cv2
import numpy as np
from scipy.spatial.transform import Rotation
from vcd import utils

ahead = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])  # a camera's z ahead, x to the right, y down
turns = {
    "40 degrees about z": Rotation.from_euler("z", 40.0, degrees=True),
    "roll 3, pitch 5, yaw 40 degrees": Rotation.from_euler("ZYX", [40.0, 5.0, 3.0], degrees=True),
    "a camera that looks ahead": Rotation.from_matrix(ahead),
}
print("vcd", version("vcd"), "opencv", cv2.__version__, "numpy", np.__version__)
wrong = []
for words, turn in turns.items():
    matrix = turn.as_matrix()
    theirs = np.ravel(utils.R2rvec(matrix))
    opencv = cv2.Rodrigues(matrix)[0].ravel()
    wrong.append(np.degrees((Rotation.from_matrix(cv2.Rodrigues(theirs)[0]) * turn.inv()).magnitude()))
    print(f"  {words}: vcd {theirs.round(3)}, OpenCV {opencv.round(3)}; as a vector vcd's is {wrong[-1]:.1f} degrees off")
    assert np.allclose(Rotation.from_euler("ZYX", theirs[::-1]).as_matrix(), matrix, atol=1e-6), "vcd gives no roll, pitch and yaw now"
assert wrong[0] < 1e-3 and wrong[1] > 1.0 and wrong[2] > 20.0, "vcd no longer does this"
print("a rotation vector is three angles")
PYTHON
