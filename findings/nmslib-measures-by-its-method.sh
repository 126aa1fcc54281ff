#!/usr/bin/env bash
# nmslib 2.1.2's space "l2" is the Euclidean distance by its name and its manual. Its exact search (`seq_search`) gives that, and its graph
# (`hnsw`), which most use, gives the square: 3 m become 9. The neighbours are the same. One space, one cloud, one call, and the unit
# hangs on the method; `vptree` gives metres as well.
#
# Guess before it was run: the same distances from all methods of a space, in metres.
# For whom it matters: whoever tries a faster index, or checks the graph against the exact search: bounds and means for matches change their
# meaning, and below a metre the errors of a fit look far smaller. Take the root of what `hnsw` gives.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "nmslib==2.1.2" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import nmslib
import numpy as np
from scipy.spatial import cKDTree

rng = np.random.default_rng(0)
cloud, scan = rng.uniform(-10.0, 10.0, (5000, 3)).astype(np.float32), rng.uniform(-10.0, 10.0, (100, 3)).astype(np.float32)
true, nearest = cKDTree(cloud).query(scan)
print("nmslib", version("nmslib"), "scipy", version("scipy"), "numpy", np.__version__)
print(f"  a tree's mean distance: {true.mean():.3f}")
found = {}
for method in ("seq_search", "vptree", "hnsw"):
    index = nmslib.init(method=method, space="l2", data_type=nmslib.DataType.DENSE_VECTOR)
    index.addDataPointBatch(cloud)
    index.createIndex(print_progress=False) if method == "hnsw" else index.createIndex()
    answers = index.knnQueryBatch(scan, k=1, num_threads=1)
    rows = np.array([answer[0][0] for answer in answers])
    found[method] = np.array([answer[1][0] for answer in answers])
    same = np.mean(rows == nearest)
    print(f"  {method}: mean distance {found[method].mean():.3f}, the tree's neighbour in {same:.0%}")
    assert same > 0.95
    right = rows == nearest
    assert np.allclose(found[method][right], true[right] ** (2 if method == "hnsw" else 1), atol=1e-3), f"{method} measures otherwise"
print("squares from one method, metres from the others")
PYTHON
