#!/usr/bin/env bash
# pyvista 0.49.1 reads PTS, the text of laser scanners, by vtk 9.7.2's `vtkPTSReader`, which leaves the first two points out. Of 600
# points 598 come back, whether the number of points stands above them or not, with and without intensities and colours. Of two
# scans in one file it reads the first, less two points, and makes a point of the second's number of points.
#
# Guess before it was run: as many points as the first row says (noted after a first odd output).
# For whom it matters: whoever keeps labels, times or partners by the row of a point: row k of the file is row k - 2 there, and no
# two of a pair lie together; whoever checks a conversion by its counts. For distances between clouds it hardly matters.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyvista==0.49.1" "vtk==9.7.2" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pyvista

points = np.random.default_rng(0).uniform(-20.0, 20.0, (600, 3)).round(3)
grey, colours = np.full((600, 1), -700), np.full((600, 3), 90)
files = {
    "x y z": (points, True),
    "x y z, no number of points above": (points, False),
    "x y z intensity": (np.hstack([points, grey]), True),
    "x y z intensity red green blue": (np.hstack([points, grey, colours]), True),
}
print("pyvista", version("pyvista"), "vtk", version("vtk"), "numpy", np.__version__)
for words, (rows, counted) in files.items():
    with open("scan.pts", "w") as file:
        file.write("600\n" if counted else "")
        np.savetxt(file, rows, "%.3f %.3f %.3f" + " %d" * (rows.shape[1] - 3))
    found = np.asarray(pyvista.read("scan.pts").points)
    print(f"  {words}: {len(found)} of 600 points, the first of them row {int(np.abs(points - found[0]).max(axis=1).argmin()) + 1}")
    assert len(found) == 598 and np.abs(found - points[2:]).max() < 1e-5, "pyvista no longer does this"
with open("scans.pts", "w") as file:
    for part in (points[:400], points[400:]):
        file.write(f"{len(part)}\n")
        np.savetxt(file, part, "%.3f")
both = np.asarray(pyvista.read("scans.pts").points)
print(f"  two scans, of 400 and 200 points: {len(both)}, the last of them ({', '.join(f'{each:g}' for each in both[-1])})")
assert len(both) == 399 and both[-1].tolist() == [200.0, 0.0, 0.0], "pyvista no longer does this"
print("the first two points are gone")
PYTHON
