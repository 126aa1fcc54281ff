#!/usr/bin/env bash
# ifcopenshell 0.9.0.post1 gives the geometry of a product in metres, whatever the unit of the IFC file, and the matrix of
# its placement (`ifcopenshell.util.placement.get_local_placement`) in the unit of the file, mostly millimetres: moved by
# it, a wall lies a thousand times too far away. `shape.transformation.matrix` is in metres, but its sixteen numbers stand
# column after column; `ifcopenshell.util.shape.get_shape_matrix` gives the matrix that belongs to the geometry.
#
# Guess before it was run: both come in one unit, and sixteen numbers reshaped to 4 x 4 are the matrix.
# For whom it matters: whoever makes a cloud of a building model to register a scan with it. Of a model with one product
# nothing shows: each shape is right in itself.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "ifcopenshell==0.9.0.post1" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import ifcopenshell.api.context as contexts
import ifcopenshell.api.geometry as geometries
import ifcopenshell.api.project as projects
import ifcopenshell.api.root as roots
import ifcopenshell.api.unit as units
import ifcopenshell.geom
import ifcopenshell.util.placement
import ifcopenshell.util.shape
import numpy as np

file = projects.create_file()
roots.create_entity(file, ifc_class="IfcProject")
units.assign_unit(file, units=[units.add_si_unit(file, unit_type="LENGTHUNIT", prefix="MILLI")])
model = contexts.add_context(file, context_type="Model")
body = contexts.add_context(
    file, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=model
)
wall = roots.create_entity(file, ifc_class="IfcWall")
shape = geometries.add_wall_representation(file, context=body, length=5.0, height=3.0, thickness=0.2)
geometries.assign_representation(file, product=wall, representation=shape)
c, s = np.cos(np.pi / 6.0), np.sin(np.pi / 6.0)
true = np.array([[c, -s, 0.0, 10.0], [s, c, 0.0, 20.0], [0.0, 0.0, 1.0, 3.0], [0.0, 0.0, 0.0, 1.0]])
geometries.edit_object_placement(file, product=wall, matrix=true)  # metres

built = ifcopenshell.geom.create_shape(ifcopenshell.geom.settings(), wall)
vertices = np.array(built.geometry.verts).reshape(-1, 3)
placement = np.array(ifcopenshell.util.placement.get_local_placement(wall.ObjectPlacement))
reshaped = np.array(built.transformation.matrix).reshape(4, 4)
matrix = ifcopenshell.util.shape.get_shape_matrix(built)
print("ifcopenshell", version("ifcopenshell"), "numpy", np.__version__, "a file in millimetres")
print(f"  the vertices of a wall of 5 m reach from {vertices.min(axis=0)} to {vertices.max(axis=0)}")
print(f"  get_local_placement puts it at {placement[:3, 3]}")
print(f"  transformation.matrix, reshaped, has the last row {reshaped[3]}")
print(f"  get_shape_matrix puts it at {matrix[:3, 3]}")
assert np.allclose(np.ptp(vertices, axis=0), [5.0, 0.2, 3.0]) and np.allclose(matrix, true)
assert np.allclose(placement[:3, 3], 1000.0 * true[:3, 3]), "ifcopenshell no longer does this"
assert np.allclose(reshaped, true.T), "ifcopenshell no longer does this"
print("the geometry is in metres, the placement in millimetres")
PYTHON
