#!/usr/bin/env bash
# pyoctomap 1.2.2's `extractPointCloud` gives the upper corner of each voxel, half a voxel off its middle in x, y and z, while
# `getCoordinate` of the same leaf and `castRay` give the middle. Where eight voxels or more were joined into a larger one
# (pruned), it gives the middles of the small ones: a map that is partly solid is moved in parts.
#
# Guess before it was run: the middles of the occupied voxels.
# For whom it matters: whoever takes the map's points to register a scan, or to compare: the pose is off by half a voxel along
# each axis, 9 cm at voxels of 10 cm. Gather `getCoordinate()` of the occupied leaves.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyoctomap==1.2.2" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pyoctomap

print("pyoctomap", version("pyoctomap"), "numpy", np.__version__)


def sorted_rows(rows):
    """Rows in an order of their own, to tenths of a millimetre."""
    return np.unique(np.round(np.asarray(rows, np.float64), 4), axis=0)


for size in (0.1, 0.5):
    cells = np.unique(np.random.default_rng(0).integers(-6, 6, (100, 3)), axis=0) * 3  # no two are neighbours
    middles = sorted_rows((cells + 0.5) * size)
    tree = pyoctomap.OcTree(size)
    for middle in middles:
        tree.updateNode(middle, True)
    leaves = sorted_rows([leaf.getCoordinate() for leaf in tree.begin_leafs() if tree.isNodeOccupied(leaf)])
    points = sorted_rows(tree.extractPointCloud()[0])
    assert leaves.shape == points.shape and np.allclose(leaves, middles, atol=2e-4)
    off = np.mean(points - middles, axis=0)
    print(f"  {len(points)} voxels of {size} m: leaves at their middles, points {np.round(off, 3)} m off")
    assert np.allclose(points - middles, size / 2.0, atol=3e-4), "pyoctomap no longer does this"

middles = np.stack(np.meshgrid(*3 * [np.arange(0.05, 1.6, 0.1)]), -1).reshape(-1, 3)
tree = pyoctomap.OcTree(0.1)
for _ in range(10):  # until every voxel is as sure as it can be
    for middle in middles:
        tree.updateNode(middle, True)
leaves, points = sum(1 for _ in tree.begin_leafs()), sorted_rows(tree.extractPointCloud()[0])
print(f"  a solid block of {len(middles)} voxels, joined into {leaves}: points {np.round(np.mean(points - sorted_rows(middles), axis=0), 3)} m off")
assert leaves == 1 and np.allclose(points, sorted_rows(middles), atol=2e-4), "pyoctomap no longer does this"
print("points at corners, and at middles where voxels are joined")
PYTHON
