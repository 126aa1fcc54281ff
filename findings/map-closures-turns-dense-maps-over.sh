#!/usr/bin/env bash
# map_closures 2.2.0 lays each local map level before it looks for loop closures. A map of 120 m whose points are a few
# centimetres apart is laid on its side or upside down, though half of its points lie on level ground to two centimetres;
# thinned to half a metre, the same map stays as it was. `get_best_closure(id, local_map)` takes any points and says nothing; the
# pictures from above that it compares then show the town from the side.
#
# Guess before it was run: more points on the ground find the ground no worse.
# For whom it matters: whoever gives it submaps of a LiDAR odometry as they are, or maps from a terrestrial scanner, and takes
# "no closure" for an answer about the place. Its own pipeline thins to `density_map_resolution`, half a metre, first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "map_closures==2.2.0" "numpy<2.3"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from map_closures.map_closures import MapClosures


def town(seed, n=200_000):
    """Level ground and the two near walls of sixty buildings, metres."""
    rng = np.random.default_rng(seed)
    parts = [np.column_stack([rng.uniform(-60.0, 60.0, (n // 3, 2)), rng.normal(0.0, 0.02, n // 3)])]
    for _ in range(60):
        (x, y), (long, wide), high = rng.uniform(-55.0, 55.0, 2), rng.uniform(1.0, 8.0, 2), rng.uniform(2.0, 12.0)
        u = rng.uniform(0.0, 1.0, (n // 120, 4))
        none = np.zeros(len(u))
        parts.append(np.column_stack([x + long * u[:, 0], y + none, high * u[:, 1]]))
        parts.append(np.column_stack([x + none, y + wide * u[:, 2], high * u[:, 3]]))
    return np.vstack(parts)


def thinned(points, voxel):
    return points[np.unique(np.floor(points / voxel).astype(int), axis=0, return_index=True)[1]]


def tilt(points):
    maps = MapClosures()
    maps.get_best_closure(0, points)
    return float(np.degrees(np.arccos(np.clip(maps.get_ground_alignment_from_id(0)[2, 2], -1.0, 1.0))))


print("map_closures", version("map_closures"), "numpy", np.__version__)
towns = [town(seed) for seed in range(8)]
dense, thin = [tilt(each) for each in towns], [tilt(thinned(each, 0.5)) for each in towns]
print("  a level town is turned by, in degrees:")
print(f"  {len(towns[0])} points:", *(f"{each:.0f}" for each in dense))
print(f"  {len(thinned(towns[0], 0.5))} points:", *(f"{each:.0f}" for each in thin))
assert max(thin) < 2.0, "map_closures no longer keeps thinned maps level"
assert sum(each > 45.0 for each in dense) >= 3, "map_closures no longer turns dense maps over"
print("turns dense maps over")
PYTHON
