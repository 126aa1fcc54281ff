#!/usr/bin/env bash
# scikit-image 0.26.0's `marching_cubes` gives faces and normals that contradict each other, unless it is told
# `gradient_direction="ascent"`: of an occupied ball (1 inside, 0 outside) the faces are wound inwards and the normals point
# outwards, of a distance field it is the other way round. Its page says that faces follow the left-hand rule; trimesh, Open3D
# and vtk follow the right hand, so that trimesh finds the ball's volume negative, and what is inside outside.
#
# Guess before it was run: for an object that is greater than what is around it, the default, both point outwards (noted after
# a look at a distance field, where they disagreed).
# For whom it matters: whoever makes a mesh of an occupancy grid to register to, or to test what lies inside: signs of distances,
# normals of samples and offsets along them are reversed. Give "ascent" for occupancy, and look at trimesh's `volume`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "scikit-image==0.26.0" "trimesh==5.2.0" "rtree" "numpy<2.5" "scipy<1.18"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import trimesh
from skimage.measure import marching_cubes

middle = np.array([9.5, 9.0, 8.0])
reach = np.linalg.norm(np.stack(np.meshgrid(*3 * [np.arange(20)], indexing="ij"), -1) - middle, axis=-1)
print("scikit-image", version("scikit-image"), "trimesh", version("trimesh"), "numpy", np.__version__)
agree = {}
for name, field, level in (("occupied ball", (reach < 5.0).astype(float), 0.5), ("distance field", reach - 5.0, 0.0)):
    for direction in ("descent", "ascent"):
        corners, faces, normals, _ = marching_cubes(field, level, gradient_direction=direction)
        mesh = trimesh.Trimesh(corners, faces, process=False)
        outward = float(np.mean(np.einsum("ij,ij->i", normals, corners - middle) > 0.0))
        depth = float(trimesh.proximity.signed_distance(mesh, middle[None])[0])
        agree[name, direction] = (outward > 0.99) == (mesh.volume > 0.0)
        print(f"  {name}, {direction}: normals {outward:.0%} outwards, volume {mesh.volume:.0f}, the middle {depth:+.2f} m inside")
        assert outward in (0.0, 1.0) and abs(abs(mesh.volume) / 523.6 - 1.0) < 0.1
        if (name, direction) == ("occupied ball", "descent"):
            assert outward == 1.0 and mesh.volume < 0.0 and depth < 0.0, "scikit-image no longer does this"
assert not agree["occupied ball", "descent"] and not agree["distance field", "descent"], "scikit-image no longer does this"
assert agree["occupied ball", "ascent"] and agree["distance field", "ascent"]
print("by default the faces look inwards where the normals look outwards")
PYTHON
