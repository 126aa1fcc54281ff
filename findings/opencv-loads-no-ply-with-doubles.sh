#!/usr/bin/env bash
# opencv-python-headless 5.0.0.93: `cv2.loadPointCloud` reads a PLY file only where its coordinates are floats. Doubles,
# which PLY has beside them and in which Open3D and this library write coordinates, give (None, None, None) and a line in the
# log for each. Its documentation says that it throws an error if a cloud cannot be read; nothing is thrown, for a missing
# file neither.
#
# Guess before it was run: doubles are read and rounded to floats, which it returns; else an error, as documented.
# For whom it matters: whoever hands an aligned or merged cloud to OpenCV. Save x, y and z as floats, about a near origin.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "opencv-python-headless==5.0.0.93" "plyfile==1.1.5" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import cv2
import numpy as np
from plyfile import PlyData, PlyElement

points = np.random.default_rng(0).uniform(-50.0, 50.0, (100, 3))


def loaded(**kinds):
    """The points (N, 3) that OpenCV reads of a file with these properties, or None; those of plyfile must be right."""
    rows = np.zeros(len(points), list(kinds.items()))
    for axis, values in zip("xyz", points.T):
        rows[axis] = values
    PlyData([PlyElement.describe(rows, "vertex")]).write("cloud.ply")
    vertex = PlyData.read("cloud.ply")["vertex"]
    assert np.allclose(np.column_stack([vertex[axis] for axis in "xyz"]), points, atol=1e-5)
    found = cv2.loadPointCloud("cloud.ply")[0]
    return None if found is None else found.reshape(-1, 3)


singles = {"x": "f4", "y": "f4", "z": "f4"}
clouds = {
    "floats": loaded(**singles),
    "floats, colours and times": loaded(**singles, red="u1", green="u1", blue="u1", time="f8"),
    "doubles": loaded(x="f8", y="f8", z="f8"),
}
print("opencv-python-headless", version("opencv-python-headless"), "plyfile", version("plyfile"))
for kind, found in clouds.items():
    print(f"  {kind}: {'None' if found is None else f'{len(found)} points'}")
missing = cv2.loadPointCloud("no such file.ply")
print(f"  a file that is not there: {missing}")
for kind in ("floats", "floats, colours and times"):
    assert np.allclose(clouds[kind], points, atol=1e-5)
assert clouds["doubles"] is None and missing == (None, None, None), "opencv no longer does this"
print("what it cannot read is None, not an error")
PYTHON
