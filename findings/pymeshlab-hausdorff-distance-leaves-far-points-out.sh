#!/usr/bin/env bash
# pymeshlab 2025.7.post1's `get_hausdorff_distance` leaves out every point that is farther from the other cloud than half the
# diagonal of the current mesh, which is the one added last, whichever is sampled: from the mean, the RMS and the maximum. The
# number called Hausdorff's is then that of the points that fit, it changes with the order of loading, and of two clouds that
# lie apart it is 0.0. `n_samples` in the answer is smaller than the number of points; nothing else tells.
#
# Guess before it was run: the greatest of all distances, and the mean over all points.
# For whom it matters: whoever scores a registration by it: a part that lies far off, as after a wrong pose or beside a small
# target, improves the score. Give `maxdist=pymeshlab.PureValue(1e9)`, and compare `n_samples` with `vertex_number()`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pymeshlab==2025.7.post1" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pymeshlab
from scipy.spatial import cKDTree

random = np.random.default_rng(0)
target = random.uniform(0.0, 1.0, (500, 3))
source = np.vstack([target[:400] + [0.0, 0.0, 0.01], random.uniform(3.0, 4.0, (100, 3))])
distance = cKDTree(target).query(source)[0]
meshes = pymeshlab.MeshSet()
for cloud in (source, target):
    meshes.add_mesh(pymeshlab.Mesh(vertex_matrix=cloud))
print("pymeshlab", version("pymeshlab"), "numpy", np.__version__)
print(f"  by a tree: {len(source)} points, maximum {distance.max():.3f} m, mean {distance.mean():.3f} m")
seen = {}
for words, limit in (("as it comes", {}), ("with a maxdist of 1e9", {"maxdist": pymeshlab.PureValue(1e9)})):
    found = meshes.get_hausdorff_distance(sampledmesh=0, targetmesh=1, samplevert=True, **limit)
    seen[words] = found
    print(f"  {words}: {found['n_samples']} points, maximum {found['max']:.3f} m, mean {found['mean']:.3f} m")
apart = pymeshlab.MeshSet()
for cloud in (source, target + [10.0, 0.0, 0.0]):
    apart.add_mesh(pymeshlab.Mesh(vertex_matrix=cloud))
none = apart.get_hausdorff_distance(sampledmesh=0, targetmesh=1, samplevert=True)
print(f"  ten metres apart, as it comes: {none['n_samples']} points, maximum {none['max']:.3f} m, mean {none['mean']:.3f} m")
assert none["n_samples"] == 0 and none["max"] == 0.0, "pymeshlab no longer does this"
assert np.isclose(seen["with a maxdist of 1e9"]["max"], distance.max(), rtol=1e-5)
assert seen["as it comes"]["n_samples"] == 400 and seen["as it comes"]["max"] < 0.011, "pymeshlab no longer does this"
print("what lies far off does not count")
PYTHON
