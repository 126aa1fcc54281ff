#!/usr/bin/env bash
# numba-kdtree 0.6.0's `query` has scipy's arguments, and returns the number of neighbours as a third value. Where there are fewer than
# asked for, within `distance_upper_bound` or in the cloud, or where the query is NaN, the index is -1 and the distance is what the
# memory held before: numbers near zero in a fresh process, and other distances later. scipy's tree gives infinity and the number of
# points.
#
# Guess before it was run: an infinite distance, and the number of points or -1 for an index.
# For whom it matters: whoever takes it in scipy's place within compiled loops and keeps matches by `distance < limit` or `isfinite`:
# what has no partner is matched at no distance, with the last point of the map, which is what -1 is to numpy. Use the third value.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "numba-kdtree==0.6.0" "numba==0.68.1" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from numba_kdtree import KDTree
from scipy.spatial import cKDTree

rng = np.random.default_rng(0)
map_ = rng.uniform(-5.0, 5.0, (2000, 3))
scan = np.vstack([map_[:100] + 0.01, map_[:100] + 100.0])  # the second half has no partner
LIMIT = 0.5
print("numba-kdtree", version("numba-kdtree"), "scipy", version("scipy"), "numpy", np.__version__)
told, rows, counts = (np.ravel(each) for each in KDTree(map_).query(scan, k=1, distance_upper_bound=LIMIT))
true, _ = cKDTree(map_).query(scan, distance_upper_bound=LIMIT)
missing = counts == 0
print(f"  {int(missing.sum())} of {len(scan)} points have no partner within {LIMIT} m; indices {np.unique(rows[missing])}")
print(f"  finite distances among them: {int(np.isfinite(told[missing]).sum())}, of scipy's tree {int(np.isfinite(true[missing]).sum())}")
print(f"  nearer than {LIMIT} m by their distance: {int((told[missing] < LIMIT).sum())}")
assert missing.sum() == 100 and set(rows[missing]) == {-1}
assert np.allclose(told[~missing], true[~missing]) and np.isinf(true[missing]).all()
assert not np.isinf(told[missing]).all(), "numba-kdtree now gives infinite distances"
print("a missing neighbour has a distance of no meaning")
PYTHON
