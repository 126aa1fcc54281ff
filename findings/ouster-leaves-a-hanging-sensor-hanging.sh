#!/usr/bin/env bash
# ouster-sdk 1.0.1's `get_rot_matrix_to_align_to_gravity` gives the rotation that turns a measured acceleration to
# (0, 0, 1). For a sensor that hangs exactly upside down, (0, 0, -9.81), it gives the identity: the cloud stays upside
# down, and nothing is raised. A thousandth of a degree beside that it turns by 180 degrees, as it should.
#
# Guess before it was run: a half turn about some horizontal axis, or an error as the axis is not known.
# For whom it matters: whoever levels clouds of a sensor mounted overhead with the nominal value, or that of a
# simulation, instead of a measured one, which never is exact. Give the half turn yourself: diag(1, -1, -1).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "ouster-sdk==1.0.1"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from ouster.sdk.core import get_rot_matrix_to_align_to_gravity

print("ouster-sdk", version("ouster-sdk"), "numpy", version("numpy"))
nearly = 9.81 * np.radians(0.001)
found = {}
for acceleration in ((0.0, 0.0, 9.81), (9.81, 0.0, 0.0), (0.0, nearly, -9.81), (0.0, 0.0, -9.81)):
    for fix_yaw in (True, False):
        rotation = get_rot_matrix_to_align_to_gravity(*acceleration, fix_yaw)
        assert abs(np.linalg.det(rotation) - 1.0) < 1e-9, "it is no rotation"
        up = rotation @ np.array(acceleration) / np.linalg.norm(acceleration)
        found[acceleration, fix_yaw] = up
        print(f"  {np.round(acceleration, 5)}, fix_yaw={fix_yaw}: turned to {np.round(up, 3) + 0.0}")
for (acceleration, _), up in found.items():
    expected = -1.0 if acceleration == (0.0, 0.0, -9.81) else 1.0
    assert abs(up[2] - expected) < 1e-6, "ouster-sdk no longer does this"
print("exactly upside down stays so, and nothing else does")
PYTHON
