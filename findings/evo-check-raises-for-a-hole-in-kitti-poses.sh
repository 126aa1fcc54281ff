#!/usr/bin/env bash
# evo 1.38.1 has `PosePath3D.check()` to tell whether a trajectory is valid, as a flag and words for each part. A pose
# that is missing (NaN) in a TUM file is told so; the same hole in a KITTI file is read without a word, and `check()`
# raises numpy's LinAlgError: it turns the matrix into a quaternion before it asks whether it is a rotation.
#
# Guess before it was run: `check()` returns False for both, and says that the poses are not valid.
# For whom it matters: whoever writes a line for each frame, as KITTI's format counts lines, and has no pose for some.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "evo==1.38.1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import numpy as np
from evo.tools import file_interface

warnings.simplefilter("ignore")  # numpy's, of determinants of NaN
with open("kitti.txt", "w") as file:
    file.write("1 0 0 0 0 1 0 0 0 0 1 0\n" + " ".join(["nan"] * 12) + "\n")
with open("tum.txt", "w") as file:
    file.write("0 0 0 0 0 0 0 1\n1 " + " ".join(["nan"] * 7) + "\n")

print("evo", version("evo"), "numpy", version("numpy"))
told = {}
for name, read in (
    ("tum.txt", file_interface.read_tum_trajectory_file),
    ("kitti.txt", file_interface.read_kitti_poses_file),
):
    path = read(name)
    try:
        told[name] = path.check()[0]
        print(f"  {name}: {path.num_poses} poses, check() returns {path.check()}")
    except np.linalg.LinAlgError as error:
        told[name] = type(error).__name__
        print(f"  {name}: {path.num_poses} poses, check() raises LinAlgError: {error}")
assert told == {"tum.txt": False, "kitti.txt": "LinAlgError"}, "evo no longer does this"
print("the check tells the hole in one format and fails at it in the other")
PYTHON
