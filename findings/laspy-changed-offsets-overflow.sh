#!/usr/bin/env bash
# laspy 2.7.0 refuses coordinates that do not fit a LAS file's 32 bits when they are assigned, but not when the header's
# offsets (or scales) are changed afterwards: `write` then stores other coordinates, thousands of kilometres away.
#
# Guess before it was run: a file that cannot hold its coordinates is refused by OverflowError, as at the assignment.
# For whom it matters: whoever moves a tile from a map's grid towards the origin, or makes its scale finer, and saves it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "laspy==2.7.0" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import laspy
import numpy as np

truth = np.array([[500_000.25, 5_400_000.5, 100.0], [500_010.25, 5_400_020.5, 101.0]])


def tile(offsets):
    header = laspy.LasHeader(point_format=3, version="1.2")
    header.scales, header.offsets = [0.001] * 3, offsets
    data = laspy.LasData(header)
    data.x, data.y, data.z = truth.T
    return data


print("laspy", version("laspy"), "numpy", version("numpy"))
try:
    tile([0, 0, 0])
    refused = False
except OverflowError as error:
    refused = True
    print(f"  assigned under offsets of zero: OverflowError: {error}")

tile([500_000, 5_400_000, 0]).write("right.las")
data = laspy.read("right.las")
data.header.offsets = [0, 0, 0]
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    data.write("moved.las")
print(f"  offsets set to zero, then written: {[str(each.message) for each in told] or 'no word'}")
off = {name: float(np.abs(laspy.read(name).xyz - truth).max()) for name in ("right.las", "moved.las")}
for name, metres in off.items():
    print(f"  {name}: coordinates off by {metres:.3f} m")
assert refused and off["right.las"] < 1e-3 and off["moved.las"] > 1e6, "laspy no longer does this"
print("what an assignment refuses, a change of the header and a write do with wrong coordinates")
PYTHON
