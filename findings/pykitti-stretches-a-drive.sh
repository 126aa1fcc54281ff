#!/usr/bin/env bash
# pykitti 0.3.1 makes the poses of KITTI's raw drives (`oxts`, `T_w_imu`) from latitude and longitude by a Mercator
# projection of a sphere with one scale for the whole drive. The earth is no sphere: at Karlsruhe's latitude a kilometre
# to the north comes out a metre too long, and one to the east nearly two metres too short, so that what was a right angle
# elsewhere is one no more. The readings themselves are good to centimetres.
#
# Guess before it was run: displacements agree with those on the ellipsoid to a centimetre in a kilometre.
# For whom it matters: whoever takes `T_w_imu` for the truth of frames that lie far apart (loops, maps, scan to map), or
# builds a map by it beside one in UTM. Over ten metres it is one or two centimetres. Project the latitudes and longitudes
# with pyproj instead, to UTM or to a plane about the drive's start.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pykitti==0.3.1" "opencv-python-headless==5.0.0.93" "pyproj==3.7.2" "numpy<2.4"
cd "$folder"
HOME="$folder" MPLBACKEND=Agg "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pykitti.utils import OxtsPacket, load_oxts_packets_and_poses
from pyproj import Geod

start, kilometre = (49.01, 8.43), 1000.0
earth = Geod(ellps="WGS84")
places = {"north": 0.0, "east": 90.0}
files = []
for k, azimuth in enumerate((None, *places.values())):
    latitude, longitude = start
    if azimuth is not None:
        longitude, latitude, _ = earth.fwd(longitude, latitude, azimuth, kilometre)
    packet = dict.fromkeys(OxtsPacket._fields, 0) | {"lat": latitude, "lon": longitude, "alt": 110.0, "numsats": 9}
    files.append(f"{k}.txt")
    with open(files[-1], "w") as file:
        file.write(" ".join(str(packet[field]) for field in OxtsPacket._fields))

poses = [each.T_w_imu for each in load_oxts_packets_and_poses(files)]
print("pykitti", version("pykitti"), "pyproj", version("pyproj"), "numpy", np.__version__)
length = {}
for way, pose in zip(places, poses[1:]):
    length[way] = float(np.linalg.norm((pose - poses[0])[:3, 3]))
    print(f"  1000.00 m to the {way} on the ellipsoid are {length[way]:.2f} m in T_w_imu")
assert 1000.5 < length["north"] < 1001.5 and 997.5 < length["east"] < 998.8, "pykitti no longer does this"
print("one drive, two scales")
PYTHON
