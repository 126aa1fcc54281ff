#!/usr/bin/env bash
# cadquery 2.8.0 counts in millimetres, as CAD does, and says so in the STEP files that it writes. `Assembly.export` writes these
# numbers into glTF and GLB as they are, without a scale in any node. glTF (2.0, section 3.4) is in metres: a room of 4 m is 4 km
# wide to whatever reads it. Its z up does become y up, as glTF wants it.
#
# Guess before it was run: metres and y up, as glTF has them.
# For whom it matters: whoever models a part, a room or a machine and registers scans with the exported file, as a format that
# fixes its unit is the one to trust; build123d 0.13.0's `export_gltf` does convert. Export `assembly` scaled by 0.001, or scale
# the numbers after they are read.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "cadquery==2.8.0" "trimesh==5.2.0" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import cadquery
import numpy as np
import trimesh

room = cadquery.Workplane().box(4000.0, 3000.0, 2500.0)  # millimetres
assembly = cadquery.Assembly().add(room, name="room")
print("cadquery", version("cadquery"), "trimesh", trimesh.__version__, "numpy", np.__version__)
assembly.export("room.step")
declared = Path("room.step").read_text()
unit = "SI_UNIT(.MILLI.,.METRE.)" in declared.replace(" ", "")
print(f"  room.step: its unit is the millimetre: {unit}")
sizes = {}
for name in ("room.glb", "room.gltf"):
    assembly.export(name)
    scene = trimesh.load(name, force="scene")
    sizes[name] = np.ptp(scene.bounds, axis=0)
    print(f"  {name}: {' x '.join(f'{each:.0f}' for each in sizes[name])} m (x, y up, z)")
assert unit, "the STEP file has another unit"
assert all(np.allclose(size, [4000.0, 2500.0, 3000.0]) for size in sizes.values()), "cadquery no longer does this"
print("four metres are four kilometres")
PYTHON
