#!/usr/bin/env bash
# copclib 2.6.3 writes COPC files whose header says that all points lie between 0 and 0, and whose octree has the middle 0 and no size,
# unless both are set by hand. All points are in it, and a reader that takes all of them gives them. laspy 2.7.0, asked for a
# part of the map, finds none there, and neither does copclib: no error, no warning, an empty cloud.
#
# Guess before it was run: the writer keeps the bounds of what it wrote, as laspy's does.
# For whom it matters: whoever writes a map as COPC to cut the surroundings of a scan out of it before registering: the map looks right in
# full, and empty everywhere. Set `min` and `max` of the header, and `center_x`, `center_y`, `center_z`, `halfsize` and `spacing` of the
# COPC info, before the first node is written.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "copclib==2.6.3" "laspy[lazrs]==2.7.0" "numpy<2.5"
cd "$folder"
OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import copclib
import laspy
import numpy as np

points = np.random.default_rng(0).uniform(0.0, [100.0, 80.0, 20.0], (5000, 3)) + [455_000.0, 5_427_000.0, 200.0]
low, high = points.min(0), points.max(0)
first, last = [455_010.0, 5_427_010.0], [455_050.0, 5_427_050.0]
true = int(np.all((points[:, :2] >= first) & (points[:, :2] <= last), axis=1).sum())


def write(path, by_hand):
    config = copclib.CopcConfigWriter(7, copclib.Vector3(0.001, 0.001, 0.001), copclib.Vector3(455_000, 5_427_000, 0))
    if by_hand:
        config.las_header.min, config.las_header.max = copclib.Vector3(*low), copclib.Vector3(*high)
        info = config.copc_info
        info.center_x, info.center_y, info.center_z = map(float, low + 50.0)
        info.halfsize, info.spacing = 50.0, 1.0
    writer = copclib.FileWriter(path, config)
    node = copclib.Points(config.las_header)
    for row in points:
        point = node.CreatePoint()
        point.x, point.y, point.z = map(float, row)
        node.AddPoint(point)
    writer.AddNode(copclib.VoxelKey.RootKey(), node)
    writer.Close()


print(*(f"{each} {version(each)}" for each in ("copclib", "laspy", "numpy")))
found = {}
for name, by_hand in (("as it comes", False), ("set by hand", True)):
    path = f"{by_hand}.copc.laz"
    write(path, by_hand)
    with laspy.open(path) as whole:
        box, count = whole.header.mins, len(whole.read())
    with laspy.CopcReader.open(path) as map_:
        part = len(map_.query(bounds=laspy.copc.Bounds(np.array(first), np.array(last))))
    own = len(copclib.FileReader(path).GetPointsWithinBox(copclib.Box(*first, *last)))
    found[by_hand] = (count, part, own)
    print(f"  {name}: lower corner {np.round(box, 1)}, {count} points; in a part that holds {true}: {part} by laspy, {own} by copclib")
assert found[True] == (5000, true, true)
assert found[False] == (5000, 0, 0), "copclib now writes the bounds"
print("the whole map is there, and no part of it")
PYTHON
