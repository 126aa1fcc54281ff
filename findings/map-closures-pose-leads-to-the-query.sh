#!/usr/bin/env bash
# map_closures 2.2.0's `get_best_closure(id, local_map)` compares a new map with those it has. In what it returns, the map that it
# had is the source and the new one the target, and `pose` maps the old map's points into the new map's frame. Where the new map
# is to be placed among the old ones, the pose must be inverted. Names and types are all that it says about this.
#
# Guess before it was run: the query is the source, and the pose maps it to the map that it was found in.
# For whom it matters: whoever makes an edge of a pose graph of a closure, or starts an ICP by it: for small turns both ways
# about look alike, and a wrong edge is then as far off as twice the drift.
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

rng = np.random.default_rng(0)
parts = [np.column_stack([rng.uniform(-60.0, 60.0, (60_000, 2)), rng.normal(0.0, 0.02, 60_000)])]
for _ in range(60):
    (x, y), (long, wide), high = rng.uniform(-55.0, 55.0, 2), rng.uniform(1.0, 8.0, 2), rng.uniform(2.0, 12.0)
    u = rng.uniform(0.0, 1.0, (1500, 4))
    none = np.zeros(len(u))
    parts.append(np.column_stack([x + long * u[:, 0], y + none, high * u[:, 1]]))
    parts.append(np.column_stack([x + none, y + wide * u[:, 2], high * u[:, 3]]))
town = np.vstack(parts)


def thinned(points, voxel):
    return points[np.unique(np.floor(points / voxel).astype(int), axis=0, return_index=True)[1]]


angle = np.radians(25.0)
c, s = np.cos(angle), np.sin(angle)
T_old_new = np.array([[c, -s, 0.0, 6.0], [s, c, 0.0, -3.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
new = (town - T_old_new[:3, 3]) @ T_old_new[:3, :3]  # old = T_old_new new

maps = MapClosures()
maps.get_best_closure(0, thinned(town, 0.5))
found = maps.get_best_closure(10, thinned(new, 0.5))
pose = np.asarray(found.pose)
forth, back = (float(np.abs(pose - each).max()) for each in (T_old_new, np.linalg.inv(T_old_new)))
print("map_closures", version("map_closures"), "numpy", np.__version__)
print(f"  asked with map 10: source {found.source_id}, target {found.target_id}, {found.number_of_inliers} inliers")
print(f"  pose, beside that from map 10 to map 0: {forth:.1f} m off; beside that from map 0 to map 10: {back:.1f} m off")
assert (found.source_id, found.target_id) == (0, 10), "map_closures no longer calls the old map the source"
assert back < 0.6 and forth > 5.0, "map_closures' pose no longer leads to the query"
print("pose leads to the query")
PYTHON
