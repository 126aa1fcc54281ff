#!/usr/bin/env bash
# trimesh 5.2.0's `Scene.camera_rays()` names a pixel for each ray, whose row counts from the bottom of the image, while the
# matrix `camera.K` beside it looks down the rows of an image. A depth image filled by these pixels stands on its head, and
# unprojected by `camera.K` it is a mirror image, from which no turn leads back. The rays go through the middles of pixels.
#
# Guess before it was run: pixel (0, 0) is the top left one, as in every image.
# For whom it matters: whoever renders a depth image of a mesh with it, to register it with a real camera's: a mirrored cloud fits
# nowhere, or fits wrongly where things are symmetric. Flip the rows, `image[::-1]`, first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "trimesh==5.2.0" "rtree" "numpy<2.5" "scipy<1.18"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import trimesh
from scipy.spatial import cKDTree

# Ahead of the camera, which looks along -z, with y up and x to the right: a wall, a box up on the right, a ball down on the left.
mesh = trimesh.util.concatenate([
    trimesh.creation.box([8.0, 6.0, 0.1]).apply_translation([0.0, 0.0, -6.0]),
    trimesh.creation.box([1.0, 0.6, 1.0]).apply_translation([1.2, 0.9, -4.5]),
    trimesh.creation.icosphere(3, 0.5).apply_translation([-1.0, -0.8, -4.0]),
])
scene = trimesh.Scene(mesh)
scene.camera.resolution, scene.camera.fov, scene.camera_transform = (64, 48), (60.0, 45.0), np.eye(4)
origins, ways, pixels = scene.camera_rays()
points, rows, _ = mesh.ray.intersects_location(origins, ways, multiple_hits=False)
image = np.zeros((48, 64))
image[pixels[rows, 1], pixels[rows, 0]] = -points[:, 2]
print("trimesh", version("trimesh"), "numpy", np.__version__)
up = ways[pixels[:, 1] == 0, 1]
print(f"  the rays of row 0 look {'down' if (up < 0.0).all() else 'up'}, {np.degrees(np.arcsin(-up)).max():.0f} degrees at most")
tree, off = cKDTree(points), {}
for words, depth in (("as it is", image), ("with its rows turned about", image[::-1])):
    v, u = np.nonzero(depth)
    rays = np.column_stack([u + 0.5, v + 0.5, np.ones(len(u))]) @ np.linalg.inv(scene.camera.K).T
    cloud = depth[v, u][:, None] * rays * [1.0, -1.0, -1.0]  # from x right, y down, z ahead to the camera's axes
    off[words] = float(tree.query(cloud)[0].max())
    print(f"  unprojected by camera.K, {words}: up to {off[words]:.3f} m from where the rays met the mesh")
assert (up < 0.0).all() and off["with its rows turned about"] < 1e-3, "trimesh no longer does this"
assert off["as it is"] > 0.2, "trimesh no longer does this"
print("row 0 is the lowest")
PYTHON
