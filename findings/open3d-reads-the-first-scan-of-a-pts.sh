#!/usr/bin/env bash
# open3d 0.20.0 reads of a `.pts` file with several scans, each begun by the number of its points as scanners' programs export
# them, the first scan alone, without a word about the rest, by both of its interfaces. Files of one scan come out whole.
#
# Guess before it was run: all points, or a warning that more follows.
# For whom it matters: whoever registers exports of a project with several setups: half of the place is missing, and the
# overlap with it. Compare the number of points with the number of lines, or split the file at lines of one number.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "libusb-package"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import ctypes
from importlib.metadata import version

import libusb_package
import numpy as np

ctypes.CDLL(libusb_package.get_library_path(), mode=ctypes.RTLD_GLOBAL)
import open3d as o3d

points = np.random.default_rng(0).uniform(0.0, 10.0, (50, 3))
rows = [" ".join(f"{value:.6f}" for value in point) + " -500 200 100 50\n" for point in points]
files = {
    "one.pts": ["50\n", *rows],
    "two.pts": ["25\n", *rows[:25], "25\n", *rows[25:]],
    "second.pts": ["25\n", *rows[25:]],
}
print("open3d", version("open3d"), "numpy", np.__version__)
counts = {}
for name, lines in files.items():
    with open(name, "w") as file:
        file.writelines(lines)
    old = np.asarray(o3d.io.read_point_cloud(name).points)
    new = o3d.t.io.read_point_cloud(name).point.positions.numpy()
    counts[name] = (len(old), len(new))
    print(f"  {name}: {sum(len(line) > 5 for line in lines)} points, {len(old)} read, {len(new)} by the tensor interface")
    first = points[25:] if name == "second.pts" else points
    assert np.allclose(old, first[: len(old)], atol=1e-5)
assert counts["one.pts"] == (50, 50) and counts["second.pts"] == (25, 25)
assert counts["two.pts"] == (25, 25), "open3d no longer does this"
print("what follows the first scan is not there")
PYTHON
