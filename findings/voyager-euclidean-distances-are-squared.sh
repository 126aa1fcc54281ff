#!/usr/bin/env bash
# voyager 2.2.3's `Space.Euclidean` is documented as the square root of the sum of squared differences. `query` and `get_distance` return
# that sum without the root: two points 3 m apart have the distance 9. The neighbours and their order are right.
#
# Guess before it was run: metres, as its words and its name have it.
# For whom it matters: whoever takes the nearest neighbours of a scan in a map by it: a bound of 0.5 keeps what is 0.71 m away, and a mean
# of them, as an error or a Chamfer distance, is far too small near a right pose and too large far from it. Take the root first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "voyager==2.2.3" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import voyager
from scipy.spatial import cKDTree

rng = np.random.default_rng(0)
cloud, scan = rng.uniform(-10.0, 10.0, (2000, 3)).astype(np.float32), rng.uniform(-10.0, 10.0, (50, 3)).astype(np.float32)
index = voyager.Index(voyager.Space.Euclidean, num_dimensions=3)
index.add_items(cloud)
rows, told = index.query(scan, k=1)
true, nearest = cKDTree(cloud).query(scan)
pair = index.get_distance([0.0, 0.0, 0.0], [3.0, 0.0, 0.0])
print("voyager", version("voyager"), "scipy", version("scipy"), "numpy", np.__version__)
print(f"  its words: {' '.join(str(voyager.Space.Euclidean.__doc__).split())}")
print(f"  mean distance {told.mean():.3f}, of scipy's tree {true.mean():.3f}; points 3 m apart: {pair:.1f}")
assert np.mean(rows[:, 0] == nearest) > 0.9
same = rows[:, 0] == nearest
assert np.allclose(told[same, 0], true[same] ** 2, atol=1e-3) and abs(pair - 9.0) < 1e-6, "voyager now takes the root"
print("distances are squares")
PYTHON
