#!/usr/bin/env bash
# vtk 9.7.2's `vtkSimplePointsReader` does not read rows: it takes three numbers after three as a point, wherever the lines end. Of
# text with an intensity behind each point, four numbers a row, it makes a third more points, most of them of the numbers of
# two rows; with a colour, twice as many, each second one the colour. At the first word that is no number, such as nan or a comment's #,
# it stops: what follows is missing. Its error code is 0 each time, and nothing is written to the screen.
#
# Guess before it was run: the first three numbers of each row, and an error for a row that holds no number
# (noted after a first odd output).
# For whom it matters: whoever loads exported clouds of text by VTK: the mixed cloud has the right size, and lies in the right
# place in part. `vtkDelimitedTextReader` and `vtkTableToPolyData`, or numpy, read rows.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "vtk==9.7.2" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkVersion
from vtkmodules.vtkIOLegacy import vtkSimplePointsReader

points = np.random.default_rng(0).uniform(-20.0, 20.0, (600, 3)).round(3)
hole = points.copy()
hole[200] = np.nan
print("vtk", vtkVersion.GetVTKVersion(), "numpy", np.__version__)
files = {
    "x y z": (points, ""),
    "x y z intensity": (np.column_stack([points, np.full(600, 77.0)]), ""),
    "x y z red green blue": (np.column_stack([points, np.full((600, 3), 200.0)]), ""),
    "x y z, row 201 is nan": (hole, ""),
    "x y z below a comment": (points, "# exported\n"),
}
counts, mixed = {}, {}
for words, (rows, head) in files.items():
    with open("cloud.xyz", "w") as file:
        file.write(head)
        np.savetxt(file, rows, "%.3f")
    reader = vtkSimplePointsReader()
    reader.SetFileName("cloud.xyz")
    reader.Update()
    held = reader.GetOutput()
    counts[words] = held.GetNumberOfPoints()
    found = vtk_to_numpy(held.GetPoints().GetData()) if counts[words] else np.empty((0, 3))
    nearest = [np.abs(points - each).max(axis=1).min() for each in found]
    mixed[words] = int((np.array(nearest) > 1e-3).sum())
    print(f"  {words}: {counts[words]} points of 600, {mixed[words]} of them none of the file's; error code {reader.GetErrorCode()}")
    assert reader.GetErrorCode() == 0
assert [*counts.values()] == [600, 800, 1200, 200, 0], "vtk no longer does this"
assert [*mixed.values()] == [0, 600, 600, 0, 0], "vtk no longer does this"
print("rows of four numbers are read as points of three")
PYTHON
