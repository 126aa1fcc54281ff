#!/usr/bin/env bash
# Open3D 0.20.0's `Octree.to_voxel_grid` and `VoxelGrid.create_from_octree` make one voxel of size 0 of every octree, at the
# tree's corner, and say nothing. `VoxelGrid.to_octree`, the way there, gives leaves.
#
# Guess before it was run: a voxel for each leaf, at its middle.
# For whom it matters: whoever keeps a map in an octree and takes its voxels to compare or to register: every point is "outside",
# and the middles of the voxels are one point. Walk the leaves with `traverse`, and take `origin + size / 2` of each.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "scipy==1.17.1" "numpy<2.5" "libusb-package"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import ctypes

import libusb_package  # open3d's wheel links against libusb without bringing it

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
from importlib.metadata import version

import numpy as np
import open3d as o3d
from scipy.spatial import cKDTree

points = np.random.default_rng(0).normal(size=(3000, 3)) * [3.0, 1.0, 0.5]
cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
print("open3d", version("open3d"), "scipy", version("scipy"), "numpy", np.__version__)
for depth in (3, 5, 7):
    tree, middles, sizes = o3d.geometry.Octree(depth), [], []
    tree.convert_from_point_cloud(cloud, 0.01)

    def leaf(node, info):
        if isinstance(node, o3d.geometry.OctreeLeafNode):
            middles.append(info.origin + info.size / 2.0)
            sizes.append(info.size)
        return False

    tree.traverse(leaf)
    other = o3d.geometry.VoxelGrid()
    other.create_from_octree(tree)
    for name, grid in (("to_voxel_grid", tree.to_voxel_grid()), ("create_from_octree", other)):
        voxels = grid.get_voxels()
        print(f"  depth {depth}, {len(middles)} leaves of {sizes[0]:.3f} m, by {name}: {len(voxels)} voxels of {grid.voxel_size:.3f} m")
        assert len(voxels) == 1 and grid.voxel_size == 0.0, "open3d no longer does this"
    assert cKDTree(middles).query(points)[0].max() < 0.87 * sizes[0]
assert len(middles) > 2000
print("a map becomes a point")
PYTHON
