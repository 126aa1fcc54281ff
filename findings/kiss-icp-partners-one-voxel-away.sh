#!/usr/bin/env bash
# kiss-icp 1.3.0 takes `max_correspondance_distance` in metres, but looks for a point's partner in the 27 voxels around it
# only: farther away than one to two voxels nothing is found, and the initial guess comes back as the answer.
#
# Guess before it was run: with partners allowed 6 m away, a start 2 m off comes home whatever the map's voxel.
# For whom it matters: whoever refines a coarse pose on a fine map with it, and takes what comes back for a refined pose.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "kiss-icp==1.3.0" "numpy<2.3"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from kiss_icp.mapping import VoxelHashMap
from kiss_icp.registration import Registration

rng = np.random.default_rng(0)
wall = rng.uniform(0.0, 20.0, (3, 3000))
# The floor and two walls of a room, so that every direction is held.
room = np.concatenate([np.insert(wall[k, :2000].reshape(-1, 2), k, 0.0, axis=1) for k in range(3)])
away = np.eye(4)
away[:3, 3] = [2.0, 2.0, 2.0]
print("kiss-icp", version("kiss-icp"), "numpy", version("numpy"))
left = {}
for voxel in (0.5, 1.0, 6.0):
    local_map = VoxelHashMap(voxel_size=voxel, max_distance=1e3, max_points_per_voxel=500)
    local_map.add_points(room)
    T = Registration(500, 1e-4, 1).align_points_to_map(room, local_map, away, 6.0, 2.0)
    left[voxel] = float(np.linalg.norm(T[:3, 3]))
    print(f"  voxel {voxel} m: {left[voxel]:.3f} m from the right pose after a start {12**0.5:.3f} m away")
assert left[0.5] > 1.0 and left[6.0] < 0.05, "kiss-icp no longer does this"
print("partners 6 m away were allowed: they are found on a map of 6 m, not on one of 0.5 m")
PYTHON
