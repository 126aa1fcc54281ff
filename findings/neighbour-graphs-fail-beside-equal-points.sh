#!/usr/bin/env bash
# hnswlib 0.8.0 and faiss-cpu 1.15.1's `IndexHNSWFlat` look for neighbours along a graph. Where many points lie at one place, they lose
# others: in a cloud of 3000 points and 2000 more at the origin, a quarter (hnswlib) and about two thirds (faiss) of the queries get
# a neighbour that is not the nearest, up to 3 m farther off where the points are decimetres apart. A wider search (`ef`, `efSearch`)
# finds hardly more. Without the equal points both find every neighbour.
#
# Guess before it was run: a few neighbours are missed, as the method is approximate, and a wider search finds them (noted after a
# first odd output of hnswlib).
# For whom it matters: whoever matches scans by such an index. Organised scans have all missing returns at the origin. Leave
# repeated rows out, or take a tree, which is exact.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "hnswlib==0.8.0" "faiss-cpu==1.15.1" "packaging" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import faiss
import hnswlib
import numpy as np
from scipy.spatial import cKDTree

rng = np.random.default_rng(0)
cloud = rng.normal(0.0, 1.0, (3000, 3)).astype(np.float32)
queries = rng.normal(0.0, 1.0, (1000, 3)).astype(np.float32)


def by_hnswlib(points, reach):
    index = hnswlib.Index(space="l2", dim=3)
    index.init_index(len(points), M=16, ef_construction=200)
    index.set_num_threads(1)
    index.add_items(points)
    index.set_ef(reach)
    return np.sqrt(index.knn_query(queries, 1)[1][:, 0])


def by_faiss(points, reach):
    index = faiss.IndexHNSWFlat(3, 32)
    index.hnsw.efSearch = reach
    index.add(points)
    return np.sqrt(index.search(queries, 1)[0][:, 0])


print("hnswlib", version("hnswlib"), "faiss-cpu", version("faiss-cpu"), "numpy", np.__version__)
wrong = {}
for equal in (0, 2000):
    points = np.r_[cloud, np.zeros((equal, 3), np.float32)]
    true = cKDTree(points).query(queries)[0]
    for name, find in (("hnswlib", by_hnswlib), ("faiss", by_faiss)):
        for reach in (50, 400):
            over = find(points, reach) - true
            wrong[name, equal, reach] = float(np.mean(over > 1e-3))
            share = 100.0 * wrong[name, equal, reach]
            print(f"  {name}, {equal} at the origin, reach {reach}: {share:.1f} % not the nearest, at most {over.max():.2f} farther")
for name in ("hnswlib", "faiss"):
    assert max(wrong[name, 0, reach] for reach in (50, 400)) < 0.01, f"{name} misses neighbours without them too"
    assert min(wrong[name, 2000, reach] for reach in (50, 400)) > 0.1, f"{name} no longer does this"
print("neighbours are lost beside points that are equal")
PYTHON
