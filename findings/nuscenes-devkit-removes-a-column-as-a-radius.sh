#!/usr/bin/env bash
# nuscenes-devkit 1.2.0 says that `remove_close(radius)` removes points within a radius of the origin. It removes a square
# column: points up to 1.41 radii away in the corners, and whatever is above or below, at any height: a bridge, a ceiling,
# leaves. truckscenes-devkit 1.2.0 does the same. `from_file_multisweep` calls it for each sweep, with one metre.
#
# Guess before it was run: a ball, or a disc, of that radius.
# For whom it matters: whoever cuts the own vehicle out with a radius of two or three metres before registration, in tunnels,
# halls and under trees above all: a hole of four to six metres across is missing overhead. Filter by the distance.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet --no-deps "nuscenes-devkit==1.2.0" "truckscenes-devkit==1.2.0"
"$folder/env/bin/python" -m pip install --quiet "pyquaternion==0.9.9" "matplotlib<3.11" "pypcd4==1.5.1" "pandas<3" "scikit-learn<1.8" "shapely<2.1" tqdm cachetools \
    "opencv-python-headless<4.11" "numpy<2"
cd "$folder"
HOME="$folder" MPLBACKEND=Agg "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from nuscenes.utils import data_classes as nuscenes
from truckscenes.utils import data_classes as truckscenes

KITS = {"nuscenes-devkit": nuscenes, "truckscenes-devkit": truckscenes}
radius = 2.0
points = np.random.default_rng(0).uniform(-10.0, 10.0, (20000, 3))
distance, across = np.linalg.norm(points, axis=1), np.linalg.norm(points[:, :2], axis=1)
for name, module in KITS.items():
    held = np.zeros((4, len(points)), np.float32)
    held[:3], held[3] = points.T, np.arange(len(points))
    cloud = module.LidarPointCloud(held)
    cloud.remove_close(radius)
    gone = np.ones(len(points), bool)
    gone[cloud.points[3].astype(int)] = False
    far, wide = float(distance[gone].max()), float(across[gone].max())
    print(f"{name} {version(name)}, numpy {np.__version__}: remove_close({radius})")
    print(f"  removed {gone.sum()} points, of which {(distance[gone] < radius).sum()} are within the radius")
    print(f"  the farthest of them is {far:.2f} m away, and {wide:.2f} m in plan")
    assert not (distance[~gone] < radius).any()
    assert far > 9.9 and 2.7 < wide < 2.83, f"{name} no longer does this"
print("a radius is half the side of a column")
PYTHON
