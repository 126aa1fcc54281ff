#!/usr/bin/env bash
# whitebox-workflows 2.0.6 writes and reads `.e57`, and what it writes only it can read: E57 has pages of 1024 bytes that end in a
# checksum, and its files have neither. pye57 0.4.19 (libE57) and e57 0.2.3 (Rust) raise for them; the other way about, it
# raises for files of pye57, which e57 reads, as if they were damaged. It writes without an error and reads its own again,
# so that nothing tells until the file has been handed on.
#
# Guess before it was run: an E57 of one program is an E57 to the others; poses or types of numbers may be lost.
# For whom it matters: whoever delivers or archives scans in E57 by it, as the format that every scanner's program reads. LAS and
# PLY of the same program are read by others.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "whitebox-workflows==2.0.6" "pye57==0.4.19" "e57==0.2.3" "laspy==2.7.0" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import e57
import laspy
import numpy as np
import pye57
import whitebox_workflows

points = np.round(np.random.default_rng(0).uniform(-5.0, 5.0, (100, 3)), 3)
las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
las.header.scales = [0.001] * 3
las.xyz = points
las.write("cloud.las")
whitebox = whitebox_workflows.WbEnvironment()
here = Path.cwd()
whitebox.read_lidar(str(here / "cloud.las")).write_to_path(str(here / "whitebox.e57"))
file = pye57.E57("pye57.e57", mode="w")
file.write_scan_raw({f"cartesian{axis}": points[:, k] for k, axis in enumerate("XYZ")})
file.close()

READERS = {
    "whitebox-workflows": lambda path: whitebox.read_lidar(str(here / path)).to_numpy(),
    "pye57": lambda path: pye57.E57(path).read_scan_raw(0)["cartesianX"],
    "e57": lambda path: e57.read_points(path).points,
}


def opened(reader, path):
    try:
        return len(READERS[reader](path)) == len(points)
    except Exception as error:
        print(f"    {reader} of {path}: {type(error).__name__}: {' '.join(str(error).split())[:110]}")
        return False


print(*(f"{each} {version(each)}" for each in ("whitebox-workflows", "pye57", "e57", "numpy")))
size = Path("whitebox.e57").stat().st_size
print(f"  whitebox.e57 has {size} bytes, {size % 1024} more than whole pages of 1024")
reads = {(reader, path): opened(reader, path) for path in ("whitebox.e57", "pye57.e57") for reader in READERS}
for (reader, path), right in reads.items():
    print(f"  {reader} reads {path}: {right}")
assert reads["whitebox-workflows", "whitebox.e57"] and reads["pye57", "pye57.e57"] and reads["e57", "pye57.e57"]
assert not reads["pye57", "whitebox.e57"] and not reads["e57", "whitebox.e57"], "whitebox's E57 is now read by others"
assert not reads["whitebox-workflows", "pye57.e57"], "whitebox now reads pye57's E57"
print("an e57 of its own")
PYTHON
