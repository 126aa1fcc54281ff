#!/usr/bin/env bash
# spatialmath-python 1.1.18 has classes (SE3, SO3 and others) that hold one pose or a whole trajectory. Of an object that
# holds many, numpy sees the memory of the first: `np.asarray(poses)`, `np.save`, `np.linalg.inv` and `np.allclose` work
# on that one alone, give what looks like a single pose, and say nothing. `.A`, the class's own `inv()` and `*` take all.
#
# Guess before it was run: an array of shape (n, 4, 4), as of a list of such objects, or an error.
# For whom it matters: whoever hands a trajectory to a library that takes arrays, saves it, or compares it with another by
# numpy: two trajectories that share their first pose count as equal. Pass `numpy.stack(poses.A)`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "spatialmath-python==1.1.18" "numpy<2.4"
cd "$folder"
HOME="$folder" MPLBACKEND=Agg "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from spatialmath import SE3

poses = SE3([SE3.Tx(1.0), SE3.Tx(2.0), SE3.Tx(3.0)])
other = SE3([SE3.Tx(1.0), SE3.Ty(7.0), SE3.Rz(2.0)])
np.save("poses.npy", poses)
shapes = {
    "numpy.asarray(poses)": np.asarray(poses).shape,
    "numpy.save and numpy.load": np.load("poses.npy").shape,
    "numpy.linalg.inv(poses)": np.linalg.inv(poses).shape,
    "numpy.stack of a list of one pose each": np.stack([each for each in poses]).shape,
    "numpy.stack(poses.A)": np.stack(poses.A).shape,
    "numpy.stack(poses.inv().A)": np.stack(poses.inv().A).shape,
}
same = bool(np.allclose(poses, other))
print("spatialmath-python", version("spatialmath-python"), "numpy", np.__version__)
print(f"  an SE3 that holds {len(poses)} poses")
for what, shape in shapes.items():
    print(f"  {what}: shape {shape}")
print(f"  numpy.allclose with a trajectory that begins alike and goes elsewhere: {same}")
assert list(shapes.values()) == [(4, 4)] * 3 + [(3, 4, 4)] * 3 and same, "spatialmath no longer does this"
assert np.array_equal(np.asarray(poses), poses[0].A)
print("numpy is shown the first pose of a trajectory, and not that there are others")
PYTHON
