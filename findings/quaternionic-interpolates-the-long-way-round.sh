#!/usr/bin/env bash
# quaternionic 1.0.18's `slerp` goes from one quaternion to the other as they are, also where their signs make that the long way round, and
# its `from_rotation_matrix` gives signs that turn where a heading passes 90 degrees. Half way between poses that head 85 and 95
# degrees a sensor heads -90; between 40 and 50 it heads 45. `slerp` of numpy-quaternion 2024.0.13, by the same hands, and scipy's
# `Slerp` give 90. Its description says that the result varies smoothly, which it does.
#
# Guess before it was run: the short way, as in numpy-quaternion and scipy.
# For whom it matters: whoever interpolates poses for the moments of points or images: of a drive nearly all pairs are right, and at one
# pair in a turn the sensor spins around. `unflip_rotors` of the row of quaternions first cures it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "quaternionic==1.0.18" "numpy-quaternion==2024.0.13" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import quaternion
import quaternionic
from scipy.spatial.transform import Rotation, Slerp

HALF = np.array([0.5])


def heading(R):
    return float(np.degrees(np.arctan2(R[1, 0], R[0, 0])))


print("quaternionic", version("quaternionic"), "numpy-quaternion", version("numpy-quaternion"), "numpy", np.__version__)
found = {}
for first, last in ((40.0, 50.0), (85.0, 95.0)):
    turns = Rotation.from_euler("z", [[first], [last]], degrees=True)
    rows = quaternionic.array.from_rotation_matrix(turns.as_matrix())
    cured = quaternionic.unflip_rotors(rows)
    older = quaternion.from_rotation_matrix(turns.as_matrix())
    found[first] = (
        heading(quaternionic.slerp(rows[0], rows[1], HALF)[0].to_rotation_matrix),
        heading(quaternionic.slerp(cured[0], cured[1], HALF)[0].to_rotation_matrix),
        heading(quaternion.as_rotation_matrix(quaternion.slerp(older[0], older[1], 0.0, 1.0, 0.5))),
        heading(Slerp([0.0, 1.0], turns)(0.5).as_matrix()),
    )
    words = ", ".join(f"{value:.1f}" for value in found[first])
    print(f"  half way from {first:.0f} to {last:.0f} degrees (quaternionic, with equal signs, numpy-quaternion, scipy): {words}")
assert np.allclose(found[40.0], 45.0) and np.allclose(found[85.0][1:], 90.0)
assert abs(abs(found[85.0][0] - 90.0) - 180.0) < 1e-6, "quaternionic now goes the short way"
print("a sensor that turns by ten degrees spins around")
PYTHON
