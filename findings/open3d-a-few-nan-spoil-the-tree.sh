#!/usr/bin/env bash
# Open3D 0.20.0 keeps points that are NaN, as organised PCD files have them where nothing came back (`read_point_cloud` leaves
# them in by default), and nothing that follows says so. Ten of them in a target of 5000 and its KD-tree misses neighbours: the
# distances of a cloud to its own copy are metres instead of zero, and ICP begun at the true pose has half of the fitness.
# `voxel_down_sample` gives a single point. A point that is NaN has the distance 0 to any cloud.
#
# Guess before it was run: NaN points are left out, or refused; scipy's KD-tree refuses them.
# For whom it matters: whoever reads organised clouds, unprojects depths with holes, or divides by ranges, and then registers.
# `remove_non_finite_points()` on every cloud, before anything else, helps.
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

points = np.random.default_rng(0).uniform(-5.0, 5.0, (5000, 3)) * [1.0, 0.6, 0.3]
holes = points.copy()
holes[:10] = np.nan


def cloud(rows):
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(rows))


full = cloud(points)
o3d.io.write_point_cloud("holes.pcd", cloud(holes))
read = o3d.io.read_point_cloud("holes.pcd")
clean = o3d.geometry.PointCloud(read).remove_non_finite_points()
print("open3d", version("open3d"), "numpy", np.__version__)
found = {}
for name, target in (("with ten NaN", read), ("without them", clean)):
    distances = np.asarray(full.compute_point_cloud_distance(target))[10:]
    icp = o3d.pipelines.registration.registration_icp(full, target, 1.0)
    thin = len(target.voxel_down_sample(0.5).points)
    wrong = float((distances > 1e-6).mean())
    found[name] = wrong, float(distances.max()), float(icp.fitness), thin
    print(
        f"  {name}: {len(target.points)} points, {100 * wrong:.0f} % of the distances to its copy are not 0, the largest "
        f"{distances.max():.2f} m; ICP's fitness {icp.fitness:.2f}; {thin} voxels of 0.5 m"
    )
missing = np.asarray(read.compute_point_cloud_distance(full))[:10]
print("  distances of the NaN points:", missing.tolist())
wrong, largest, fitness, thin = found["with ten NaN"]
assert found["without them"][0] == 0.0 and found["without them"][2] == 1.0 and found["without them"][3] > 1000
assert len(read.points) == 5000 and wrong > 0.1 and largest > 1.0 and fitness < 0.8 and thin == 1, "open3d no longer does this"
assert not missing.any(), "open3d no longer does this"
print("two points of a thousand spoil the tree")
PYTHON
