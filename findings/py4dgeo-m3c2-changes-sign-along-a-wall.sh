#!/usr/bin/env bash
# py4dgeo 1.2.0's M3C2 gives a distance the sign of a normal, and turns normals towards `orientation_vector`, (0, 0, 1) unless told. On a
# wall that is a matter of noise: of 400 core points on one that moved by 10 cm as a whole, half say +0.10 and half -0.10, and their
# mean is next to nothing. Each distance and its level of detection are right but for the sign.
#
# Guess before it was run: one wall has one sign, as one floor has (noted after a first odd output).
# For whom it matters: whoever measures a facade, a cliff or a tunnel, or how far two registered clouds lie apart, and averages: the mean
# of a shift is near none, its spread looks like noise, and a colour scale shows speckle. Give `orientation_vector` a direction that
# looks away from the wall, one for each wall.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "py4dgeo==1.2.0" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON' 2>&1 | grep -v INFO
from importlib.metadata import version

import numpy as np
import py4dgeo

rng = np.random.default_rng(0)


def surface(at, count=20_000):
    """Along x and y, with a centimetre of noise; as a wall, along x and z."""
    return np.c_[rng.uniform(-10.0, 10.0, (count, 2)), at + rng.normal(0.0, 0.01, count)]


def distances(columns, **options):
    first, second = (np.ascontiguousarray(each[:, columns]) for each in (before, after))
    found = py4dgeo.M3C2(
        epochs=(py4dgeo.Epoch(first), py4dgeo.Epoch(second)),
        corepoints=np.ascontiguousarray(core[:, columns]),
        normal_radii=[1.0],
        cyl_radius=0.5,
        max_distance=2.0,
        **options,
    )
    return found.run()[0]


before, after = surface(0.0), surface(0.1)
core = np.c_[rng.uniform(-8.0, 8.0, (400, 2)), np.zeros(400)]
wall = [0, 2, 1]  # it moved along y
told = {
    "floor": distances([0, 1, 2]),
    "wall": distances(wall),
    "wall, told y": distances(wall, orientation_vector=np.array([0.0, 1.0, 0.0])),
}
print("py4dgeo", version("py4dgeo"), "numpy", np.__version__)
for words, each in told.items():
    print(f"  {words}: mean {each.mean():+.3f} m, of the sizes {np.abs(each).mean():.3f} m, {np.mean(each < 0):.0%} negative")
assert abs(told["floor"].mean() - 0.1) < 0.01 and abs(told["wall, told y"].mean() - 0.1) < 0.01
assert abs(told["wall"].mean()) < 0.04 and 0.3 < np.mean(told["wall"] < 0.0) < 0.7, "py4dgeo no longer does this"
assert abs(np.abs(told["wall"]).mean() - 0.1) < 0.01
print("a wall that moved as a whole moves both ways")
PYTHON
