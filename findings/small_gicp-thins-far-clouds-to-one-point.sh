#!/usr/bin/env bash
# small_gicp 1.0.1 numbers voxels by 21 bits an axis. From 2^20 voxels off the origin on (262 km at its default of 0.25 m;
# UTM northings are millions) `voxelgrid_sampling` gives a single point for a whole cloud, and `align` registers one point
# to one point: `converged` is True, and the pose is wrong. A line for each point goes to the standard error of the
# process, which no Python code sees.
#
# Guess before it was run: an exception, or a result that has not converged.
# For whom it matters: whoever aligns georeferenced clouds without moving them to the origin first, and trusts `converged`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "small_gicp==1.0.1" "numpy<2.5"
"$folder/env/bin/python" - 2> /dev/null <<'PYTHON'
from importlib.metadata import version

import numpy as np
import small_gicp

rng = np.random.default_rng(0)
n = 6000
u, v, kind = rng.uniform(0, 30, n), rng.uniform(0, 6, n), rng.integers(0, 3, n)[:, None]
surfaces = [np.c_[u, 0 * u, v], np.c_[0 * u, u, v], np.c_[u, rng.uniform(0, 30, n), 0 * u]]  # two walls and a floor
scene = np.choose(kind, surfaces) + rng.normal(0, 0.01, (n, 3))
turn = np.radians(2.0)
R = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])

print("small_gicp", version("small_gicp"))
found = {}
for east in (0.0, 262_000.0, 300_000.0):
    there = np.array([east, 0.0, 0.0])
    target, source = scene + there, (scene - [0.3, 0.2, 0.0]) @ R + there
    result = small_gicp.align(target, source, downsampling_resolution=0.25)
    T = result.T_target_source
    error = np.median(np.linalg.norm(source @ T[:3, :3].T + T[:3, 3] - target, axis=1))
    left = small_gicp.voxelgrid_sampling(target, 0.25).size()
    found[east] = (left, result.converged, result.num_inliers, error > 0.1)
    print(
        f"  {east / 1000:.0f} km east: {left} of {n} points left, converged {result.converged}, "
        f"{result.num_inliers} inliers, median error {error:.2f} m"
    )
assert not found[0.0][3] and not found[262_000.0][3], "near the origin it no longer aligns"
left, converged, inliers, wrong = found[300_000.0]
assert left == 1 and converged and inliers <= 1 and wrong, "small_gicp no longer does this"
PYTHON
