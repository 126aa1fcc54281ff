#!/usr/bin/env bash
# pymeshlab 2025.7.post1 reads every scan of an E57 file as a mesh whose vertices lie in the scanner's frame, with the
# scan's pose as a matrix beside them (`transform_matrix()`). `vertex_matrix()` and `save_current_mesh` leave that matrix
# out: PLY, XYZ and OBJ hold the scan as if its scanner had stood at the origin. `transformed_vertex_matrix()`, and what
# is saved after `apply_matrix_freeze()`, lie where the file says.
#
# Guess before it was run: the scans of one file lie in one frame, and what is saved lies where MeshLab shows it.
# For whom it matters: whoever turns the scans of a survey into PLY files and takes them for registered, or scores a
# registration by them. Call `apply_matrix_freeze()` for each mesh before it is saved.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pymeshlab==2025.7.post1" "pye57==0.4.19" "numpy<2.4"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pye57
import pymeshlab

own = np.random.default_rng(0).uniform(-10.0, 10.0, (600, 3))
R, t = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]), np.array([100.0, 50.0, 2.0])
there = own @ R.T + t

half = np.sqrt(0.5)
file = pye57.E57("scan.e57", mode="w")
columns = {f"cartesian{axis}": own[:, k] for k, axis in enumerate("XYZ")}
columns["intensity"] = np.full(len(own), 0.5)
file.write_scan_raw(columns, name="scan", rotation=np.array([half, 0.0, 0.0, half]), translation=t)
file.close()

def loaded(name):
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.load_new_mesh(name)
    return meshes


def where(points):
    off = {"the scanner's frame": own, "the file's frame": there}
    return next(words for words, each in off.items() if np.abs(points - each).max() < 1e-4)


found = {}
scan = loaded("scan.e57")
found["vertex_matrix()"] = where(scan.current_mesh().vertex_matrix())
found["transformed_vertex_matrix()"] = where(scan.current_mesh().transformed_vertex_matrix())
for ending in ("ply", "xyz", "obj"):
    scan.save_current_mesh(f"saved.{ending}")
again = loaded("saved.ply")
found["saved.ply"] = where(again.current_mesh().transformed_vertex_matrix())
found["saved.xyz"] = where(np.loadtxt("saved.xyz")[:, :3])
with open("saved.obj") as text:
    found["saved.obj"] = where(np.array([line.split()[1:4] for line in text if line.startswith("v ")], float))
scan.apply_matrix_freeze()
scan.save_current_mesh("frozen.ply")
again = loaded("frozen.ply")
found["frozen.ply"] = where(again.current_mesh().vertex_matrix())

print("pymeshlab", version("pymeshlab"), "pye57", version("pye57"), "numpy", version("numpy"))
for what, frame in found.items():
    print(f"  {what}: {frame}")
lost = {what for what, frame in found.items() if frame == "the scanner's frame"}
told = {"vertex_matrix()", "saved.ply", "saved.xyz", "saved.obj"}
assert lost == told, "pymeshlab no longer does this"
print("an E57 scan is saved without the pose that it was read with")
PYTHON
