#!/usr/bin/env bash
# pykdtree 1.4.3 marks a neighbour that is not there in two ways. With `distance_upper_bound` it is as in scipy: an infinite
# distance and the number of points as its index. Without one, where fewer points than asked for are there or the query is
# NaN, the index is 4294967295 and the distance finite: 1.8e19 in single precision, 1.3e154 in double.
#
# Guess before it was run: in single precision as in scipy, whose interface it follows, infinite and the number of points.
# For whom it matters: whoever puts it in scipy's place for speed, with scans whose missing returns are NaN or with small
# clusters: `isfinite` keeps these neighbours, means of distances explode, and the index fits no padded array. Give a
# `distance_upper_bound` that is larger than the cloud.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pykdtree==1.4.3" "scipy<1.18" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pykdtree.kdtree import KDTree
from scipy.spatial import cKDTree

random = np.random.default_rng(0)
points, queries = random.uniform(0.0, 10.0, (2, 3)), random.uniform(0.0, 10.0, (2, 3))
print("pykdtree", version("pykdtree"), "scipy", version("scipy"), "numpy", np.__version__)
distance, index = cKDTree(points).query(queries, 3)
print("  scipy, three neighbours of two points:", distance[0], index[0])
found = {}
for kind in ("f4", "f8"):
    tree = KDTree(points.astype(kind))
    for words, limit in (("no bound", {}), ("a bound of 100", {"distance_upper_bound": 100.0})):
        distance, index = tree.query(queries.astype(kind), 3, **limit)
        found[kind, words] = float(distance[0, 2]), int(index[0, 2])
        print(f"  pykdtree, {kind}, {words}:", distance[0], index[0])
    distance, index = tree.query(np.full((1, 3), np.nan, kind), 1)
    found[kind, "NaN"] = float(distance[0]), int(index[0])
    print(f"  pykdtree, {kind}, of a query that is NaN:", distance, index)
for kind in ("f4", "f8"):
    assert found[kind, "a bound of 100"] == (np.inf, 2)
    for words in ("no bound", "NaN"):
        distance, index = found[kind, words]
        assert np.isfinite(distance) and index == 4294967295, "pykdtree no longer does this"
print("what is not there has a distance")
PYTHON
