#!/usr/bin/env bash
# velodyne-decoder 3.1.0's `min_angle` and `max_angle` keep the points between two azimuths: 30 to 90 degrees are the sector of 60 degrees
# on the right. A sector across the front, where azimuths begin anew, cannot be had: 330 to 30, -30 to 30 and 330 to 390 are all taken,
# and give the 300 degrees beside it, as if both ends were put in order first. Nothing is said.
#
# Guess before it was run: the 60 degrees in front, or a refusal (of 330 to 30 noted after a first run).
# For whom it matters: whoever cuts a scan down to what a camera or a second LiDAR in front sees, before the two are registered: the front
# is what is missing, and the rest looks like a scan. Keep all, and cut by `arctan2(y, x)`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "velodyne-decoder==3.1.0" "numpy<2.5"
cd "$folder"
TZ=UTC "$folder/env/bin/python" - <<'PYTHON'
import struct
from importlib.metadata import version

import numpy as np
import velodyne_decoder

STEP = 40  # hundredths of a degree from block to block, of two firings each


def packet(number):
    """Twelve blocks of a VLP-16 that sees a wall 10 m away, one return each."""
    blocks = (
        struct.pack("<HH", 0xEEFF, (number * 12 + k) * STEP % 36_000) + struct.pack("<HB", 5000, 100) * 32 for k in range(12)
    )
    micro = int(number * 12 * 2 * 55.296)
    return 1_700_000_000.0 + micro / 1e6, b"".join(blocks) + struct.pack("<IBB", micro, 0x37, 0x22)


print("velodyne-decoder", version("velodyne-decoder"), "numpy", np.__version__)
found = {}
for sector in ((0, 360), (30, 90), (330, 30), (-30, 30), (330, 390)):
    config = velodyne_decoder.Config(model=velodyne_decoder.Model.VLP16, min_angle=sector[0], max_angle=sector[1])
    stream = velodyne_decoder.StreamDecoder(config)
    scans = [scan for scan in (stream.decode(*packet(k), as_pcl_structs=True) for k in range(160)) if scan]
    points = scans[1][1]
    azimuth = np.degrees(np.arctan2(-points["y"], points["x"])) % 360.0  # clockwise from the front, as the sensor counts
    front = int(np.sum((azimuth < 29.0) | (azimuth > 331.0)))
    found[sector] = (len(points), front)
    print(f"  {sector[0]} to {sector[1]} degrees: {len(points)} points, {front} of them within 29 degrees of the front")
whole = found[0, 360]
assert whole[0] == 28_800 and whole[1] > 4000
assert abs(found[30, 90][0] - 4800) < 20 and found[30, 90][1] == 0
assert all(abs(found[s][0] - 24_000) < 20 and found[s][1] == 0 for s in ((330, 30), (-30, 30), (330, 390))), "it now takes the front"
print("the sector in front is what is left out")
PYTHON
