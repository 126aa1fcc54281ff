#!/usr/bin/env bash
# PCD allows coordinates of eight bytes (`SIZE 8`), as clouds in a map's frame need. Open3D 0.20.0's
# `open3d.io.read_point_cloud` reads such a file as so many points at (0, 0, 0), and pypointcloud 0.1.0 takes the first four
# bytes of each number for a float. Neither raises or warns. `open3d.t.io.read_point_cloud` and pypcd4 1.5.1 read what
# stands there.
#
# Guess before it was run: a reader that knows floats alone refuses the file, or rounds its numbers.
# For whom it matters: whoever writes doubles so as not to lose digits (hybridreg does when `dtype="float64"` asks for it)
# and passes the file on. Write PLY, which Open3D reads in doubles either way, or subtract an offset and write floats.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "pypointcloud==0.1.0" "pypcd4==1.5.1" "numpy<2.5" \
    "libusb-package"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import ctypes
from importlib.metadata import version

import libusb_package
import numpy as np
import pypointcloud
from pypcd4 import PointCloud

ctypes.CDLL(libusb_package.get_library_path(), mode=ctypes.RTLD_GLOBAL)
import open3d as o3d

points = np.arange(90.0).reshape(30, 3) + [450_000.0, 5_400_000.0, 300.0]
for name, code in (("floats.pcd", "<f4"), ("doubles.pcd", "<f8")):
    size = np.dtype(code).itemsize
    header = (
        f"VERSION 0.7\nFIELDS x y z\nSIZE {size} {size} {size}\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 30\nHEIGHT 1\n"
        "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 30\nDATA binary\n"
    )
    with open(name, "wb") as file:
        file.write(header.encode() + points.astype(code).tobytes())

readers = {
    "open3d.io": lambda name: np.asarray(o3d.io.read_point_cloud(name).points),
    "open3d.t.io": lambda name: o3d.t.io.read_point_cloud(name).point["positions"].numpy(),
    "pypointcloud": lambda name: pypointcloud.load_pcd(name)[0],
    "pypcd4": lambda name: PointCloud.from_path(name).numpy(("x", "y", "z")),
}
print(*(f"{each} {version(each)}" for each in ("open3d", "pypointcloud", "pypcd4", "numpy")), sep=", ")
off = {}
for name in ("floats.pcd", "doubles.pcd"):
    print(f"  {name}, its first point {points[0].tolist()}")
    for how, read in readers.items():
        found = np.asarray(read(name), dtype=np.float64)
        off[how, name] = float(np.abs(found - points).max())
        print(f"    {how}: {found.shape}, first {np.round(found[0], 3).tolist()}")
for (how, name), most in off.items():
    misread = name == "doubles.pcd" and how in ("open3d.io", "pypointcloud")
    assert most > 1e5 if misread else most < 0.3, "this has changed"
print("a valid file, and two readers that make other points of it without a word")
PYTHON
