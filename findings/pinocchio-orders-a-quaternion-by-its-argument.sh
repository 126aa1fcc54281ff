#!/usr/bin/env bash
# pinocchio 4.1.0 (package pin) makes a quaternion of four numbers, `Quaternion(w, x, y, z)`, with w first, and of one vector of the
# same four, `Quaternion(numpy.array([...]))`, with w last. (1, 0, 0, 0) is no turn in the one and half a turn about x in
# the other. Neither has to be of length 1: `SE3(quaternion, place)` and `XYZQUATToSE3`, which wants w last, make of one with few
# digits, or of a sum for a mean, a matrix that is no rotation, without a word.
#
# Guess before it was run: one order, whichever way the numbers are handed over; and a rotation comes of it.
# For whom it matters: whoever reads poses of a data set or a calibration into it: nuScenes, COLMAP and EuRoC have w first, ROS and
# TUM w last, and unpacking a row by * turns one into the other. A rotation near none becomes one near half a turn.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pin==4.1.0" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pinocchio as pin

row = np.array([1.0, 0.0, 0.0, 0.0])
place = np.array([1.0, 2.0, 3.0])


def degrees(quaternion):
    return float(np.degrees(np.linalg.norm(pin.log3(quaternion.toRotationMatrix()))))


unpacked, whole = degrees(pin.Quaternion(*row)), degrees(pin.Quaternion(row))
rough = pin.Quaternion(0.9, 0.3, 0.0, 0.0)  # of length 0.95
R = pin.SE3(rough, place).rotation
off = float(np.abs(R @ R.T - np.eye(3)).max())
made = pin.XYZQUATToSE3(np.concatenate([place, [0.3, 0.0, 0.0, 0.9]])).rotation
print("pin", version("pin"), "numpy", np.__version__)
print(f"  Quaternion(*row) turns by {unpacked:.0f} degrees, Quaternion(row) by {whole:.0f}")
print(f"  SE3 of a quaternion of length {rough.norm():.2f}: R R^T is off by {off:.2f}, determinant {np.linalg.det(R):.2f}")
print(f"  XYZQUATToSE3 of the same: off by {np.abs(made @ made.T - np.eye(3)).max():.2f}")
assert round(unpacked) == 0 and round(whole) == 180, "pinocchio now has one order"
assert off > 0.01, "pinocchio's SE3 now makes a rotation of it"
assert np.abs(made @ made.T - np.eye(3)).max() > 0.01, "XYZQUATToSE3 now makes a rotation of it"
print("orders a quaternion by its argument")
PYTHON
