#!/usr/bin/env bash
# pyquaternion 0.9.9's `yaw_pitch_roll` are said to be the angles about z, then y', then x''. They are those of the product
# R_x(roll) R_y(pitch) R_z(yaw), which its description has too, two lines below: the other order. The yaw is no heading of a sensor
# that leans: of one turned by 30 degrees, then tilted down by 20 and rolled by 10, it is 28.5 degrees, and rolled by 60 it is -0.5.
# scipy's `as_euler("ZYX")` gives the angles of the name. Upright both agree.
#
# Guess before it was run: scipy's "ZYX", as for the convention that is named (noted after a first odd output).
# For whom it matters: whoever takes the heading of a camera or a tilted LiDAR from nuScenes' quaternions, for a start or a box in the
# bird's eye view, or makes a pose of the three angles by another library. Take `rotation_matrix[:, 0]`, or scipy.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyquaternion==0.9.9" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pyquaternion import Quaternion
from scipy.spatial.transform import Rotation

print("pyquaternion", version("pyquaternion"), "scipy", version("scipy"), "numpy", np.__version__)
off = {}
for pitch, roll in ((0.0, 0.0), (20.0, 10.0), (20.0, 60.0)):
    turn = Rotation.from_euler("ZYX", [30.0, pitch, roll], degrees=True)
    x, y, z, w = turn.as_quat()
    named = np.degrees(Quaternion(w, x, y, z).yaw_pitch_roll)
    ahead = turn.as_matrix()[:, 0]
    heading = float(np.degrees(np.arctan2(ahead[1], ahead[0])))
    other = Rotation.from_euler("XYZ", named[::-1], degrees=True)
    off[roll] = abs(named[0] - heading)
    print(f"  heading {heading:.1f}, tilt {pitch:.0f}, roll {roll:.0f}: yaw, pitch, roll {np.round(named, 1)}")
    assert (other * turn.inv()).magnitude() < 1e-9, "they are no angles of that product any more"
assert off[0.0] < 1e-9 and off[10.0] > 1.0 and off[60.0] > 10.0, "pyquaternion's yaw is the heading now"
print("the yaw of a leaning sensor is not its heading")
PYTHON
