#!/usr/bin/env bash
# pyrr 0.10.3 turns a vector by a quaternion one way, and by the matrix that it makes of it, `Matrix33.from_quaternion`, the other way: the
# matrix is the usual one, for columns, and `*` multiplies it by a row. `numpy.array(matrix) @ vector` turns as the quaternion does.
# `from_z_rotation` has the same two senses. Of Euler angles the two classes take other axes: the third of (0, 0, 30) is about z for
# the quaternion, and about y for the matrix.
#
# Guess before it was run: a quaternion and its matrix turn a vector to one place.
# For whom it matters: whoever takes a pose out of a viewer or an engine that counts with pyrr: whether its matrix or its transpose is the
# pose hangs on which of its calls made the points. Turn the three axes by both, and compare.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyrr==0.10.3" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pyrr import Matrix33, Quaternion, Vector3
from scipy.spatial.transform import Rotation

angle = np.radians(30.0)
x, z = Vector3([1.0, 0.0, 0.0]), [0.0, 0.0, angle]
turn = Quaternion.from_z_rotation(angle)
ways = {
    "Quaternion.from_z_rotation": turn * x,
    "Matrix33.from_quaternion of it": Matrix33.from_quaternion(turn) * x,
    "Matrix33.from_z_rotation": Matrix33.from_z_rotation(angle) * x,
    "Quaternion.from_eulers (0, 0, 30)": Quaternion.from_eulers(z) * x,
    "Matrix33.from_eulers (0, 0, 30)": Matrix33.from_eulers(z) * x,
}
true = Rotation.from_rotvec(z).apply(x)
by_numpy = np.array(Matrix33.from_quaternion(turn)) @ np.array(x)
print("pyrr", version("pyrr"), "scipy", version("scipy"), "numpy", np.__version__)
print(f"  scipy: x goes to {np.round(true, 3)}")
for words, each in ways.items():
    print(f"  {words}: x goes to {np.round(np.array(each), 3)}")
print(f"  numpy.array(Matrix33.from_quaternion) @ x: {np.round(by_numpy, 3)}")
assert np.allclose(by_numpy, true), "pyrr's matrix is another now"
found = [np.array(each) for each in ways.values()]
assert np.allclose(found[0], true) and np.allclose(found[3], true), "pyrr's quaternion turns otherwise now"
assert np.allclose(found[1], true * [1.0, -1.0, 1.0]) and np.allclose(found[2], found[1]), "pyrr's matrix now turns as its quaternion"
assert abs(found[4][1]) < 1e-9 and abs(found[4][2]) > 0.4, "pyrr's Euler angles are about z now"
print("a matrix turns against its quaternion")
PYTHON
