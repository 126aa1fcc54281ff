#!/usr/bin/env bash
# dm-robotics-transformations 0.10.0 makes axis and angle of a rotation matrix, `rmat_to_axisangle`, by dividing the matrix's skew part by
# the sine of its angle. For a half turn both are nothing but rounding, and the axis is one of rounding too: of a thousand half turns about
# any axis nearly all come out more than a degree off, one in three of an upside-down sensor's. A thousandth of a degree aside they are
# right, and so are all of them by way of a quaternion. Only matrices that are symmetric to the last bit take its other branch.
#
# Guess before it was run: near a half turn, axis and angle are right to 1e-6 degrees (it has a branch of its own for that).
# For whom it matters: whoever writes the poses of a registration as rotation vectors for MuJoCo, a robot or an optimizer: a LiDAR that
# hangs upside down has half turns in its pose. Use `quat_to_axisangle(mat_to_quat(matrix))`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "dm-robotics-transformations==0.10.0" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import numpy as np
from dm_robotics.transformations import transformations
from scipy.spatial.transform import Rotation

warnings.simplefilter("ignore")  # of its own call of arccos
rng = np.random.default_rng(0)
COUNT = 1000


def half_turn(short_of=0.0):
    axis = rng.normal(size=3)
    return Rotation.from_rotvec((np.pi - np.radians(short_of)) * axis / np.linalg.norm(axis)).as_matrix()


def upside_down():
    """A sensor that hangs, on a vehicle of any heading."""
    vehicle = Rotation.from_euler("z", rng.uniform(-180.0, 180.0), degrees=True).as_matrix()
    sensor = Rotation.from_euler("ZYX", [rng.uniform(-180.0, 180.0), 0.0, 180.0], degrees=True).as_matrix()
    return vehicle @ sensor


def by_quaternion(matrix):
    return transformations.quat_to_axisangle(transformations.mat_to_quat(matrix))


def degrees_off(matrix, vector):
    rest = Rotation.from_rotvec(vector).as_matrix().T @ matrix
    return np.degrees(Rotation.from_matrix(rest).magnitude())


def errors(make, way):
    return np.array([degrees_off(matrix, way(matrix)) for matrix in (make() for _ in range(COUNT))])


print("dm-robotics-transformations", version("dm-robotics-transformations"), "scipy", version("scipy"), "numpy", np.__version__)
found = {}
for words, make in (
    ("half turns about any axis", half_turn),
    ("an upside-down sensor", upside_down),
    ("0.001 degrees short of half turns", lambda: half_turn(0.001)),
):
    for name, way in (("rmat_to_axisangle", transformations.rmat_to_axisangle), ("by a quaternion", by_quaternion)):
        off = found[words, name] = errors(make, way)
        print(f"  {words}, {name}: {np.mean(off > 1.0):.1%} more than a degree off, median {np.median(off):.3g}, at most {off.max():.3g}")
assert np.mean(found["half turns about any axis", "rmat_to_axisangle"] > 1.0) > 0.8, "half turns keep their axis now"
assert np.mean(found["an upside-down sensor", "rmat_to_axisangle"] > 1.0) > 0.15, "half turns keep their axis now"
assert found["0.001 degrees short of half turns", "rmat_to_axisangle"].max() < 1e-3
assert all(off.max() < 1e-3 for (_, name), off in found.items() if name == "by a quaternion")
print("half turns lose their axis")
PYTHON
