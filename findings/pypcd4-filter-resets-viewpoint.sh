#!/usr/bin/env bash
# pypcd4 1.4.0 reads and saves the VIEWPOINT of a PCD file (where the sensor stood), but a cloud made by selecting rows
# of it, or by adding two clouds, says that its sensor stood at the origin.
#
# Guess before it was run: rows of a cloud were seen from where the whole cloud was seen, so VIEWPOINT stays.
# For whom it matters: whoever crops or merges scans with it and then trusts VIEWPOINT, as normals and free space do.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pypcd4==1.4.0" "numpy<2.3"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pypcd4 import PointCloud

header = (
    "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 10\nHEIGHT 1\n"
    "VIEWPOINT 50 20 1.8 1 0 0 0\nPOINTS 10\nDATA binary\n"
)
with open("scan.pcd", "wb") as file:
    file.write(header.encode() + np.arange(30, dtype="<f4").tobytes())

scan = PointCloud.from_path("scan.pcd")
scan.save("saved.pcd")
seen = {
    "read": scan.metadata.viewpoint,
    "saved and read again": PointCloud.from_path("saved.pcd").metadata.viewpoint,
    "rows with x > 5": scan[scan.numpy()[:, 0] > 5].metadata.viewpoint,
    "the scan and itself added": (scan + scan).metadata.viewpoint,
}
print("pypcd4", version("pypcd4"), "numpy", version("numpy"))
for how, viewpoint in seen.items():
    print(f"  {how}: VIEWPOINT {viewpoint}")
stays, origin = (50.0, 20.0, 1.8, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0)
assert list(seen.values()) == [stays, stays, origin, origin], "pypcd4 no longer does this"
print("rows and sums of clouds forget where they were seen from; reading and saving do not")
PYTHON
