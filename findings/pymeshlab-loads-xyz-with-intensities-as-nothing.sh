#!/usr/bin/env bash
# pymeshlab 2025.7.post1 loads an `.xyz` file whose rows hold x, y, z and an intensity, or x, y, z, intensity and a colour,
# as a cloud of no points, without an error. So are rows with commas, any `.txt`, and `.pts` as scanners write it (x, y, z,
# intensity, red, green, blue). Rows of six numbers are read, but a colour becomes the normal.
#
# Guess before it was run: the first three numbers of each row, or an error.
# For whom it matters: whoever loads clouds from text, in a loop above all: filters and registration then run on nothing.
# Check `vertex_number()` after each load, and give three columns with spaces between them, or PLY.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pymeshlab==2025.7.post1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pymeshlab

points = np.random.default_rng(0).uniform(-5.0, 5.0, (50, 3))
intensity = np.full((50, 1), 0.5)
colour = np.full((50, 3), [200.0, 100.0, 50.0])
files = {
    "xyz.xyz": ([points], " ", ""),
    "tabs.xyz": ([points], "\t", ""),
    "intensity.xyz": ([points, intensity], " ", ""),
    "intensity-and-colour.xyz": ([points, intensity, colour], " ", ""),
    "commas.xyz": ([points], ",", ""),
    "scanner.pts": ([points, intensity, colour], " ", "50"),
    "xyz.txt": ([points], " ", ""),
    "colour.xyz": ([points, colour], " ", ""),
}
print("pymeshlab", version("pymeshlab"), "numpy", np.__version__)
loaded = {}
for name, (columns, mark, head) in files.items():
    np.savetxt(name, np.column_stack(columns), fmt="%.6f", delimiter=mark, header=head, comments="")
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(name)
    mesh = meshes.current_mesh()
    loaded[name] = mesh.vertex_number()
    normal = mesh.vertex_normal_matrix()[0] if loaded[name] else "none"
    print(f"  {name}: {loaded[name]} of 50 points, first normal {normal}, colour {mesh.has_vertex_color()}")
assert loaded["xyz.xyz"] == loaded["tabs.xyz"] == 50
assert np.array_equal(mesh.vertex_normal_matrix()[0], colour[0]), "pymeshlab no longer does this"
del loaded["xyz.xyz"], loaded["tabs.xyz"], loaded["colour.xyz"]
assert not any(loaded.values()), "pymeshlab no longer does this"
print("one more column, and no points at all")
PYTHON
