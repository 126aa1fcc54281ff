#!/usr/bin/env bash
# compas 2.15.1 reads a mesh from OBJ with vertices that fall on the same thousandth of the file's unit made one: of a part that was scanned
# every 0.3 mm and is given in metres about one vertex in ten is left, and as few faces, without a word. The same mesh comes whole out of
# PLY and OFF. Its `precision`, "of the geometric map that is used to connect the lines", is three digits if nothing is given.
#
# Guess before it was run: its readers of STL, PLY, OFF and OBJ keep the points of the file.
# For whom it matters: whoever registers a scan to a model by it, or samples a scanned surface: steps of a millimetre, and holes where faces
# fell together. Give `precision` more digits, or write PLY.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "compas==2.15.1" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from compas.datastructures import Mesh

SIDE, STEP = 60, 0.0003
ends = np.arange(SIDE) * STEP
x, y = (grid.ravel() for grid in np.meshgrid(ends, ends))
points = np.column_stack([x, y, 0.002 * np.sin(400.0 * x)])  # a corrugated plate, metres
corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
faces = np.vstack([np.column_stack([corner, corner + 1, corner + SIDE]), np.column_stack([corner + 1, corner + SIDE + 1, corner + SIDE])])
rows, threes = [f"{a:.7f} {b:.7f} {c:.7f}" for a, b, c in points], [" ".join(map(str, face)) for face in faces]
with open("plate.obj", "w") as file:
    file.write("\n".join([f"v {row}" for row in rows] + ["f " + " ".join(str(k + 1) for k in face) for face in faces]) + "\n")
with open("plate.off", "w") as file:
    file.write("\n".join(["OFF", f"{len(rows)} {len(faces)} 0", *rows, *(f"3 {three}" for three in threes)]) + "\n")
with open("plate.ply", "w") as file:
    head = ["ply", "format ascii 1.0", f"element vertex {len(rows)}", *(f"property double {name}" for name in "xyz")]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    file.write("\n".join([*head, *rows, *(f"3 {three}" for three in threes)]) + "\n")


def counted(mesh):
    return mesh.number_of_vertices(), mesh.number_of_faces()


print("compas", version("compas"), "numpy", np.__version__)
whole = len(points), len(faces)
print(f"  written: {whole[0]} vertices, {whole[1]} faces, {1000.0 * STEP:.1f} mm apart")
found = {"OBJ": counted(Mesh.from_obj("plate.obj")), "OFF": counted(Mesh.from_off("plate.off")), "PLY": counted(Mesh.from_ply("plate.ply"))}
found["OBJ, precision=7"] = counted(Mesh.from_obj("plate.obj", precision=7))
for name, (vertices, some) in found.items():
    print(f"  {name}: {vertices} vertices, {some} faces")
assert found["OBJ"][0] < whole[0] / 4 and found["OBJ"][1] < whole[1] / 2, "it now keeps the vertices of an OBJ"
assert found["OFF"] == found["PLY"] == found["OBJ, precision=7"] == whole
print("an OBJ is welded to thousandths")
PYTHON
