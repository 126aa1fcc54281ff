#!/usr/bin/env bash
# scikit-spatial 10.0.0's `Sphere.best_fit` solves for the centre and for a number that holds the squares of the whole
# coordinates. In a map's grid (UTM northings are millions of metres) a target sphere of 7 cm comes out with a radius of
# thousands of kilometres and a centre as far off, without a word; ten kilometres off the origin it is right to a millimetre.
# Its planes and lines, which take the mean away first, are right.
#
# Guess before it was run: centre and radius to a millimetre, as for planes.
# For whom it matters: whoever joins scans by spheres that were set up in the scene, or checks a registration by them. Take the
# mean of the points away, and add it to the centre.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "scikit-spatial==10.0.0" "scipy==1.17.1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from skspatial.objects import Plane, Sphere

rng = np.random.default_rng(0)
radius = 0.0725
normals = rng.normal(size=(2000, 3))
normals[:, 0] = -np.abs(normals[:, 0])  # the half that a scanner sees
ball = radius * normals / np.linalg.norm(normals, axis=1, keepdims=True)
wall = np.column_stack([np.zeros(2000), rng.uniform(-1.0, 1.0, (2000, 2))])
print("scikit-spatial", version("scikit-spatial"), "numpy", np.__version__)
errors = {}
for name, origin in (("a room", [5.0, 7.0, 1.0]), ("10 km", [6000.0, 8000.0, 100.0]), ("a map", [500000.0, 5400000.0, 100.0])):
    found = Sphere.best_fit(ball + origin)
    plane = Plane.best_fit(wall + origin)
    errors[name] = abs(found.radius - radius), np.linalg.norm(found.point - origin)
    lean = np.degrees(np.arccos(min(1.0, abs(plane.normal[0]))))
    print(f"  {name}: radius {found.radius:.4g} (true {radius}), centre off by {errors[name][1]:.2g} m; plane leans by {lean:.2g} deg")
    assert lean < 0.01
middle = (ball + origin).mean(axis=0)
again = Sphere.best_fit(ball + origin - middle)
print(f"  a map, the mean taken away: radius {again.radius:.4g}, centre off by {np.linalg.norm(again.point + middle - origin):.1g} m")
assert max(errors["a room"]) < 1e-6 and max(errors["10 km"]) < 1e-3 and abs(again.radius - radius) < 1e-6
assert min(errors["a map"]) > 1000.0, "scikit-spatial no longer does this"
print("a ball of a hand's width, as large as the earth")
PYTHON
