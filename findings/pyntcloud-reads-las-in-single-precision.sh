#!/usr/bin/env bash
# pyntcloud 0.3.1 reads LAS in single precision: in a map's grid (UTM northings are millions of metres) its points have
# moved by up to a quarter of a metre, each by another amount. PLY of doubles it reads as such, so that of one pair one
# cloud may be rounded and the other not; and `to_file` rounds both, to every format, text too. Nothing is told.
#
# Guess before it was run: LAS has integers and a scale, so what is read is right to the millimetre; doubles stay doubles.
# For whom it matters: whoever reads airborne or surveyed clouds with it and registers them, or passes them on: northings
# come in steps of half a metre. Read LAS with laspy, and subtract an offset before anything is saved.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyntcloud==0.3.1" "laspy==2.7.0" "pandas==2.3.3" "numpy<2.4"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import laspy
import numpy as np
import pandas as pd
from pyntcloud import PyntCloud

points = np.random.default_rng(0).uniform(-20.0, 20.0, (2000, 3)) + [450_000.0, 5_400_000.0, 300.0]
header = laspy.LasHeader(point_format=1, version="1.2")
header.scales, header.offsets = [0.001] * 3, [450_000.0, 5_400_000.0, 0.0]
tile = laspy.LasData(header)
tile.x, tile.y, tile.z = points.T
tile.write("tile.las")
head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
head += "".join(f"property double {axis}\n" for axis in "xyz") + "end_header\n"
with open("tile.ply", "wb") as file:
    file.write(head.encode() + points.astype("<f8").tobytes())

read = {
    "laspy, tile.las": np.asarray(laspy.read("tile.las").xyz),
    "pyntcloud, tile.las": PyntCloud.from_file("tile.las").xyz,
    "pyntcloud, tile.ply": PyntCloud.from_file("tile.ply").xyz,
}
PyntCloud(pd.DataFrame(points, columns=list("xyz"))).to_file("saved.csv")
read["pyntcloud, doubles saved to CSV"] = pd.read_csv("saved.csv")[["x", "y", "z"]].to_numpy()
print("pyntcloud", version("pyntcloud"), "laspy", version("laspy"), "pandas", pd.__version__, "numpy", np.__version__)
off = {}
for how, found in read.items():
    off[how] = float(np.abs(found - points).max())
    print(f"  {how}: {found.dtype}, {len(np.unique(found[:, 1]))} different northings, off by up to {off[how]:.4f} m")
assert off["laspy, tile.las"] < 0.001 and off["pyntcloud, tile.ply"] < 0.001
for how in ("pyntcloud, tile.las", "pyntcloud, doubles saved to CSV"):
    assert 0.2 < off[how] < 0.3, "pyntcloud no longer does this"
print("a map's coordinates come as steps of half a metre")
PYTHON
