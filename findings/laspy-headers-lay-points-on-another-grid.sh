#!/usr/bin/env bash
# laspy 2.7.0's `LasData(header, points)` takes the points of another file with the scales and offsets of the new header: their
# whole numbers stay, and stand for other coordinates at once. With a fresh `LasHeader()`, whose scale is a centimetre and
# whose offset is zero, points of UTM that were kept in millimetres come to lie within a few hundred metres of the origin, and
# are ten times as far apart. Nothing tells so. Its writer, given the same header and points, converts them.
#
# Guess before it was run: the coordinates stay, as with `write_points`, or a header on another grid is refused (noted after a first run).
# For whom it matters: whoever makes a file of chosen points with a header of its own, for another version, point format or system,
# and registers to it: the pose takes up the offset, and nothing fits by the scale. Give the header the `scales` and
# `offsets` of the points first, assign `xyz`, or use `laspy.convert`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "laspy[lazrs]==2.7.0" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import laspy
import numpy as np

truth = np.random.default_rng(0).uniform(0.0, 40.0, (1000, 3)) + [500_000.0, 5_400_000.0, 100.0]
header = laspy.LasHeader(point_format=6, version="1.4")
header.scales, header.offsets = np.full(3, 0.001), np.array([500_000.0, 5_400_000.0, 0.0])
tile = laspy.LasData(header)
tile.xyz = truth


def fresh():
    return laspy.LasHeader(point_format=6, version="1.4")


laspy.LasData(fresh(), tile.points).write("data.laz")
with laspy.open("writer.laz", mode="w", header=fresh()) as writer:
    writer.write_points(tile.points)
assigned = laspy.LasData(fresh())
assigned.xyz = tile.xyz
assigned.write("assigned.laz")
like = fresh()
like.scales, like.offsets = tile.points.scales, tile.points.offsets
laspy.LasData(like, tile.points).write("like.laz")
print("laspy", version("laspy"), "lazrs", version("lazrs"), "numpy", np.__version__)
print(f"  a fresh header: scales {fresh().scales.tolist()}, offsets {fresh().offsets.tolist()}")
off, wide = {}, {}
for name in ("data", "writer", "assigned", "like"):
    found = np.asarray(laspy.read(f"{name}.laz").xyz)
    off[name] = float(np.abs(found - truth).max())
    wide[name] = np.ptp(found, axis=0)
    print(f"  {name}: up to {off[name]:.3f} m off, {np.round(wide[name], 1).tolist()} m wide, the first at {found[0].tolist()}")
assert off["like"] < 0.001 and max(off["writer"], off["assigned"]) < 0.011
assert off["data"] > 5e6 and np.allclose(wide["data"] / np.ptp(truth, axis=0), 10.0, rtol=1e-3), "laspy no longer does this"
print("a header turns points into others")
PYTHON
