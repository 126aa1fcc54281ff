#!/usr/bin/env bash
# pycpd 2.0.0's `RigidRegistration.register()` returns the moved cloud and (s, R, t). R is to be multiplied from the right
# onto rows, `s * Y @ R + t`: put into a pose in the usual way, `x = R y + t`, it turns the other way about, twice the
# angle off, while the cloud that is returned beside it lies where it should.
#
# Guess before it was run: R and t are those of a pose, so that the matrix [R t; 0 1] maps the source to the target.
# For whom it matters: whoever scores its pose against a truth, or moves other points or poses by it. Small turns look
# like a poor registration, not like a mistake of the convention. The pose's rotation is `R.T`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pycpd==2.0.0" "numpy<2.4"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pycpd import RigidRegistration

angle = np.radians(20.0)
c, s = np.cos(angle), np.sin(angle)
R, t = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]), np.array([0.5, -0.3, 0.2])
source = np.random.default_rng(0).normal(size=(200, 3)) * [3.0, 2.0, 1.0]
target = source @ R.T + t  # q = R p + t of every point

moved, (scale, found, shift) = RigidRegistration(X=target, Y=source, max_iterations=150).register()


def yaw(matrix):
    return float(np.degrees(np.arctan2(matrix[1, 0], matrix[0, 0])))


def off(rotation):
    return float(np.linalg.norm(scale * source @ rotation.T + shift - target, axis=1).max())


print("pycpd", version("pycpd"), "numpy", version("numpy"))
print(f"  the cloud that it returns: at most {np.linalg.norm(moved - target, axis=1).max():.1e} from the target")
print(f"  true rotation about z: {yaw(R):.2f} degrees; of the R that it returns: {yaw(found):.2f} degrees")
print(f"  points moved by q = s R p + t: at most {off(found):.2f} off; by q = s R.T p + t: {off(found.T):.1e} off")
assert np.abs(moved - target).max() < 1e-6 and abs(yaw(found) + 20.0) < 1e-3, "pycpd no longer does this"
assert off(found) > 1.0 and off(found.T) < 1e-6, "pycpd no longer does this"
print("the rotation that is returned is the transpose of the pose's")
PYTHON
