#!/usr/bin/env bash
# ouster-cli of ouster-sdk 1.0.1 saves one recording, by one command, to PLY, PCD, LAS or CSV by the ending of the name.
# The first three lie in the world's frame: the sensor's extrinsic and the frame's pose are applied. The columns X1, Y1 and
# Z1 of the CSV file lie in the sensor's own frame, and have a row at (0, 0, 0) for every pixel without a return. Nothing
# in the file, in its help or on the terminal says so.
#
# Guess before it was run: the ending decides how the same points are written, not where they lie.
# For whom it matters: whoever gave the sensors of a vehicle their extrinsics, or ran SLAM, and saves clouds to register or
# to compare: two sensors' PLY files lie in one frame, their CSV files each in their own, and the pose of one kind of file
# is not that of the other. Keep to one ending.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "ouster-sdk==1.0.1"
cd "$folder"
export HOME="$folder"
"$folder/env/bin/python" - <<'PYTHON'
import numpy as np
from ouster.sdk import core, osf

info = core.SensorInfo.from_default(core.LidarMode._1024x10)
extrinsic = np.eye(4)
extrinsic[:3, 3] = [100.0, 50.0, 2.0]
info.sensor_to_body = extrinsic
frame = core.LidarFrame(info)
ranges = np.full((frame.h, frame.w), 10_000, np.uint32)  # millimetres: a ball around the sensor
ranges[:, ::4] = 0
frame.field(core.ChanField.RANGE)[:] = ranges
frame.status[:] = 1
frame.measurement_id[:] = np.arange(frame.w)
frame.body_to_world[:] = np.eye(4)
frame.body_to_world[:, 2, 3] = 30.0  # as SLAM fills it
frame.timestamp[:] = 10**9 + np.arange(frame.w) * 97_000
with osf.Writer("scan.osf", [info]) as writer:
    writer.save(0, frame)
PYTHON
for ending in ply csv; do
    "$folder/env/bin/ouster-cli" source scan.osf save "scan.$ending" >log.txt 2>&1 || { cat log.txt; exit 1; }
done
"$folder/env/bin/python" - <<'PYTHON'
from glob import glob
from importlib.metadata import version

import numpy as np

with open(glob("scan*.ply")[0], "rb") as file:
    header = []
    while not header or header[-1] != "end_header":
        header.append(file.readline().decode().strip())
    sizes = {"float": "<f4", "double": "<f8", "uchar": "u1", "ushort": "<u2", "uint": "<u4"}
    fields = [line.split()[:0:-1] for line in header if line.startswith("property")]
    rows = np.fromfile(file, [(name, sizes[kind]) for name, kind in fields])
ply = np.column_stack([rows[axis].astype(float) for axis in "xyz"])
(name,) = glob("scan*.csv")
with open(name) as file:
    titles = [file.readline(), file.readline()][1].strip("# \n").split(", ")
columns = [titles.index(f"{axis}1 (m)") for axis in "XYZ"]
csv = np.loadtxt(name, delimiter=",", comments="#", usecols=columns)
empty = np.abs(csv).sum(axis=1) == 0.0

print("ouster-sdk", version("ouster-sdk"), "numpy", np.__version__)
middles = {}
for ending, points in (("ply", ply), ("csv", csv[~empty])):
    middles[ending] = 0.5 * (points.min(axis=0) + points.max(axis=0))
    print(f"  {ending}: {len(points)} points, their middle at {np.round(middles[ending], 1) + 0.0}")
print(f"  csv: {empty.sum()} rows more at (0, 0, 0)")
assert np.allclose(middles["ply"], [100.0, 50.0, 32.0], atol=0.5), "ouster-cli no longer does this"
assert np.allclose(middles["csv"], 0.0, atol=0.5) and empty.sum() == 64 * 256, "ouster-cli no longer does this"
print("one recording, one command: the ending decides in which frame the points lie")
PYTHON
