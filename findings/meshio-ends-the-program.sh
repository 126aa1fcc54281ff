#!/usr/bin/env bash
# meshio 5.3.5 ends the program, by SystemExit, where a file is of a kind that it knows and holds something that it does not:
# a cloud without cells that it wrote as `.vtu` itself, or a valid PLY with one more element, such as a camera. The
# exception that its readers raise for that is printed and dropped. Such a cloud as `.ply` is read again, and as
# `.vtk` is an IndexError.
#
# Guess before it was run: a cloud that meshio wrote is read again; what it cannot read is a ReadError.
# For whom it matters: whoever reads many files in a loop, in a worker or in a notebook's kernel: `except Exception` does not
# catch it, and the loop ends with code 1 at the first such file. Catch `SystemExit` around `meshio.read`, and give each
# point a cell of the type "vertex" before writing.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "meshio==5.3.5" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import meshio
import numpy as np

points = np.random.default_rng(0).uniform(-5.0, 5.0, (4, 3))
cloud = meshio.Mesh(points, [], point_data={"intensity": np.arange(4.0)})
for name in ("cloud.ply", "cloud.vtu"):
    cloud.write(name)
meshio.Mesh(points, [("vertex", np.arange(4)[:, None])]).write("vertices.vtu")
axes = "".join(f"property float {axis}\n" for axis in "xyz")
rows = "".join(" ".join(f"{value:.4f}" for value in row) + "\n" for row in points)
head = f"ply\nformat ascii 1.0\nelement vertex 4\n{axes}element camera 1\nproperty float fov\nend_header\n"
with open("camera.ply", "w") as file:
    file.write(head + rows + "90\n")

print("meshio", version("meshio"), "numpy", np.__version__)
ended = {}
for name in ("cloud.ply", "vertices.vtu", "cloud.vtu", "camera.ply"):
    try:
        found = f"{len(meshio.read(name).points)} points"
    except Exception as error:
        found = f"{type(error).__name__}, which a loop can catch"
    except SystemExit as error:
        ended[name] = error.code
        found = f"SystemExit({error.code})"
    print(f"  {name}: {found}")
assert ended == {"cloud.vtu": 1, "camera.ply": 1}, "meshio no longer does this"
print("a file that it cannot read is the end of the program")
PYTHON
