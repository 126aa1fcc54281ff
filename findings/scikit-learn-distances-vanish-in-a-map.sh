#!/usr/bin/env bash
# scikit-learn 1.9.1's `pairwise_distances`, `pairwise_distances_argmin_min` and `NearestNeighbors(algorithm="brute")`
# take a distance for the root of |a|² + |b|² - 2ab. In a map's grid (UTM northings are millions of metres) the digits that
# are left of the sum, in doubles, are those of a decimetre: two clouds a centimetre and a half apart are said to lie 0.00 m
# apart, and of a dense cloud other neighbours come first. `algorithm="kd_tree"` is right; "auto" takes brute force where
# as many neighbours are asked for as half of the points. The documentation notes that this way is not the most precise.
#
# Guess before it was run: doubles hold such coordinates to a nanometre, so that distances are right to a micron.
# For whom it matters: whoever scores a registration in a map's frame (residuals, Chamfer distance, closest points): zero is
# what a perfect pose would give. Subtract one offset from both clouds first, or take a tree.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "scikit-learn==1.9.1" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from scipy.spatial import cKDTree
from sklearn.metrics import pairwise_distances, pairwise_distances_argmin_min
from sklearn.neighbors import NearestNeighbors

rng = np.random.default_rng(0)
offset = np.array([450_000.0, 5_400_000.0, 300.0])
target = np.c_[rng.uniform(-2.0, 2.0, (4000, 2)), np.zeros(4000)] + offset  # a wall, every few centimetres a point
source = target[:500] + rng.normal(0.0, 0.01, (500, 3))
true, nearest = cKDTree(target).query(source)


def by(algorithm, neighbors=1):
    found = NearestNeighbors(n_neighbors=neighbors, algorithm=algorithm).fit(target).kneighbors(source)
    return found[0][:, 0], found[1][:, 0]


row, distance = pairwise_distances_argmin_min(source, target)
every = pairwise_distances(source, target)
near = pairwise_distances_argmin_min(source - offset, target - offset)
ways = {
    "pairwise_distances_argmin_min": (distance, row),
    "pairwise_distances": (every.min(axis=1), every.argmin(axis=1)),
    'NearestNeighbors, "brute"': by("brute"),
    'NearestNeighbors, "auto", half of the points': by("auto", 2000),
    'NearestNeighbors, "kd_tree"': by("kd_tree"),
    "pairwise_distances_argmin_min near the origin": near[::-1],
}
print("scikit-learn", version("scikit-learn"), "scipy", version("scipy"), "numpy", np.__version__)
print(f"  true: median {np.median(true):.4f} m")
middle, other = {}, {}
for way, (found, which) in ways.items():
    middle[way], other[way] = float(np.median(found)), float(np.mean(which != nearest))
    print(f"  {way}: median {middle[way]:.4f} m, {100 * other[way]:.0f} % have another neighbour")
right = list(ways)[-2:]
for way in ways:
    if way in right:
        assert abs(middle[way] - np.median(true)) < 1e-5 and other[way] < 0.01
    else:
        assert middle[way] < 0.005 and other[way] > 0.1, "scikit-learn no longer does this"
print("clouds that are a centimetre and more apart are said to lie on each other")
PYTHON
