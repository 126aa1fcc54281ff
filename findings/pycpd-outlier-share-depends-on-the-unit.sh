#!/usr/bin/env bash
# pycpd 2.0.0's `RigidRegistration(w=...)` is told which share of the points has no partner. The density of that share is a
# constant of one, whatever room the clouds fill: the same two clouds in metres and in millimetres, with the same w, get two
# poses. In millimetres every point counts as an outlier, and the source shrinks by half; in metres a room of 20 m comes
# out as without w for 0.1 and metres off for 0.5. Without w the unit does not matter. `scale=False` is taken and changes nothing.
#
# Guess before it was run: w is a share, so that the unit has no effect on the pose; and `scale=False` keeps the size.
# For whom it matters: whoever registers clouds by coherent point drift, in millimetres or outdoors, and gives w because the
# clouds overlap in part; and whoever compares with such poses.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pycpd==2.0.0" "numpy<2.5" "scipy==1.17.1"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pycpd import RigidRegistration
from scipy.spatial.transform import Rotation

rng = np.random.default_rng(0)


def room(n):
    u = rng.uniform(0.0, 1.0, (3, n, 2))
    none = np.zeros(n)
    floor = np.column_stack([20.0 * u[0, :, 0], 12.0 * u[0, :, 1], none])
    wall = np.column_stack([20.0 * u[1, :, 0], none, 4.0 * u[1, :, 1]])
    end = np.column_stack([none, 12.0 * u[2, :, 0], 4.0 * u[2, :, 1]])
    return np.vstack([floor, wall, end])


target, placed = room(200), room(200)
R, t = Rotation.from_euler("z", 8.0, degrees=True).as_matrix(), np.array([0.3, 0.2, 0.1])
source = (placed - t) @ R

print("pycpd", version("pycpd"), "numpy", np.__version__)
sizes, off = {}, {}
for w in (0.0, 0.1, 0.5):
    for unit, metre in (("m", 1.0), ("mm", 1000.0)):
        moved, (sizes[w, unit], _, _) = RigidRegistration(X=metre * target, Y=metre * source, w=w, scale=False).register()
        off[w, unit] = float(np.abs(moved / metre - placed).max())
        print(f"  w={w}, {unit:2}: size {sizes[w, unit]:.2f}, points up to {off[w, unit]:.1f} m off")
assert abs(sizes[0.0, "m"] - sizes[0.0, "mm"]) < 1e-6, "pycpd's poses without w now depend on the unit"
assert off[0.1, "m"] < 0.6 and sizes[0.1, "mm"] < 0.7 and off[0.1, "mm"] > 4.0, "pycpd no longer does this"
assert sizes[0.5, "m"] < 0.9 and off[0.5, "m"] > 2.0, "pycpd no longer does this"
print("outlier share depends on the unit")
PYTHON
