#!/usr/bin/env bash
# klampt 0.10.1.post1 holds a rotation as a list of nine numbers that run down the columns. `loader.save` writes them by rows
# as text (type "RigidTransform"), and as they are, by columns, as JSON (type "json"). The nine numbers of the one file are those of
# the inverse rotation in the other: whoever reads both with the same lines of code has one of them turned the wrong way.
#
# Guess before it was run: one order of the nine numbers, in memory and in every file (noted after a first output).
# For whom it matters: whoever brings its poses to other libraries, which mostly list rotations by rows, or reads its files without it:
# small turns look like a poor calibration. `se3.homogeneous(pose)` gives the rows of the usual matrix.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "klampt==0.10.1.post1" "numpy<2.4"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import json
from importlib.metadata import version

import numpy as np
from klampt.io import loader
from klampt.math import se3, so3

pose = (so3.rotation([0.0, 0.0, 1.0], np.radians(20.0)), [5.0, -2.0, 0.5])
matrix = np.array(se3.homogeneous(pose))
assert np.allclose(se3.apply(pose, [1.0, 0.0, 0.0]), (matrix @ [1.0, 0.0, 0.0, 1.0])[:3])
loader.save(pose, "RigidTransform", "pose.xform")
loader.save(pose, "json", "pose.json")
with open("pose.json") as file:
    of_json = json.load(file)
numbers = {
    "held": np.array(pose[0]),
    "pose.xform": np.loadtxt(open("pose.xform").read().split())[:9],
    "pose.json": np.ravel(of_json[0]),
}


def yaw(nine):
    R = nine.reshape(3, 3)
    return float(np.degrees(np.arctan2(R[1, 0], R[0, 0])))


print("klampt", version("klampt"), "numpy", np.__version__)
turns = {name: yaw(nine) for name, nine in numbers.items()}
for name, turn in turns.items():
    print(f"  {name}: {numbers[name].round(3).tolist()}, read by rows a turn of {turn:.1f} degrees")
    assert np.allclose(numbers[name].reshape(3, 3), matrix[:3, :3].T if turn < 0.0 else matrix[:3, :3])
for kind, name in (("RigidTransform", "pose.xform"), ("json", "pose.json")):
    assert np.allclose(se3.homogeneous(loader.load(kind, name)), matrix), "each is read back right by it"
assert round(turns["held"]) == round(turns["pose.json"]) == -20, "klampt no longer has columns there"
assert round(turns["pose.xform"]) == 20, "klampt no longer writes rows there"
print("by columns in memory and in JSON, by rows in text")
PYTHON
