#!/usr/bin/env bash
# point-cloud-utils 0.34.0 reads the 64-bit coordinates of a PLY file to the last digit, but `save_mesh_v` writes float64
# points as 32-bit ones, without a word: a cloud in map coordinates that is read and saved again has moved by up to a
# quarter of a metre, each point by another amount. To OBJ, OFF and STL the same call writes nothing: it raises for the
# type of `v_colors`, an argument that was not given.
#
# Guess before it was run: what was read as float64 is written as `double`, and comes back as it was.
# For whom it matters: whoever crops or thins clouds in a map's frame with it and registers the result: the noise is ten
# times a LiDAR's. Subtract an offset first, or write with a library that keeps `double`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "point-cloud-utils==0.34.0" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import point_cloud_utils as pcu

points = np.random.default_rng(0).uniform(-20.0, 20.0, (1000, 3)) + [420_000.0, 5_100_000.0, 100.0]
header = "ply\nformat binary_little_endian 1.0\nelement vertex 1000\n"
header += "".join(f"property double {axis}\n" for axis in "xyz") + "end_header\n"
with open("map.ply", "wb") as file:
    file.write(header.encode() + points.astype("<f8").tobytes())

read = pcu.load_mesh_v("map.ply")
pcu.save_mesh_v("again.ply", read)
again = pcu.load_mesh_v("again.ply")
moved = np.linalg.norm(again - points, axis=1)
print("point-cloud-utils", version("point-cloud-utils"))
print(f"read: {read.dtype}, off by {np.abs(read - points).max()} m")
print(f"saved and read again: {again.dtype}, off by {np.median(moved):.2f} m in the middle, {moved.max():.2f} m at most")
assert read.dtype == np.float64 and np.array_equal(read, points)
assert again.dtype == np.float32 and 0.2 < moved.max() < 0.4

for ending in ("obj", "off", "stl"):
    try:
        pcu.save_mesh_v(f"again.{ending}", points)
        raise SystemExit(f"{ending} was written")
    except ValueError as error:
        print(f"{ending}: ValueError: {error}")
        assert "v_colors" in str(error)
PYTHON
