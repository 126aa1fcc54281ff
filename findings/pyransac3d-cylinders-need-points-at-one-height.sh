#!/usr/bin/env bash
# pyransac3d 0.7.0's `Cylinder.fit` draws three points, lays a circle through them, and takes the circle's normal for the axis. That is
# right only where the three lie at one height of the cylinder, as on the rings of an upright scanner at an upright pole. Of a pole whose
# points lie at all heights, 600 of them and nothing else, 2 mm off at most, 3000 draws agree with a third of the points or fewer, and
# where one side alone was seen, the radius of 0.3 m may come out as tens of metres, with the axis across. Its description says: a cylinder.
#
# Guess before it was run: the axis within two degrees, and nearly all points as inliers (noted after a run in clutter, where it was lost).
# For whom it matters: whoever joins scans by poles, pillars, pipes or trunks: those of a scanner with rings work in the test, and those
# of a rosette, of a camera or of a leaning pole do not. Take the axis from normals (the direction that all of them are square to).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyransac3d==0.7.0" "numpy<2.5"
cd "$folder"
OMP_NUM_THREADS=1 "$folder/env/bin/python" -W ignore - <<'PYTHON'
import random
from importlib.metadata import version

import numpy as np
import pyransac3d

COUNT = 600
rng = np.random.default_rng(0)
heights = {"on 12 rings": np.repeat(np.linspace(0.0, 3.0, 12), 50), "at all heights": rng.uniform(0.0, 3.0, COUNT)}
print("pyransac3d", version("pyransac3d"), "numpy", np.__version__)
found = {}
for side, turn in (("all around", 2 * np.pi), ("one side", np.pi)):
    angle = rng.uniform(0.0, turn, COUNT)
    for name, z in heights.items():
        pole = np.c_[0.3 * np.cos(angle), 0.3 * np.sin(angle), z] + rng.normal(0.0, 0.002, (COUNT, 3)).clip(-0.002, 0.002)
        rows = []
        for seed in range(3):
            random.seed(seed)
            fit = pyransac3d.Cylinder().fit(pole, thresh=0.01, maxIteration=3000)
            rows.append((len(fit[3]), np.degrees(np.arccos(min(1.0, abs(fit[1][2])))), fit[2]))
        found[side, name] = np.array(rows)
        words = "; ".join(f"{int(k)} inliers, leans {lean:.1f} degrees, radius {radius:.2f} m" for k, lean, radius in rows)
        print(f"  {side}, {name}: {words}")
for side in ("all around", "one side"):
    rings, spread = found[side, "on 12 rings"], found[side, "at all heights"]
    assert rings[:, 0].min() > 0.8 * COUNT and rings[:, 1].max() < 1.0
    assert spread[:, 0].max() < 0.4 * COUNT and spread[:, 1].min() > 1.0, "pyransac3d now finds the cylinder"
assert found["one side", "at all heights"][:, 2].max() > 10.0
print("a cylinder is found by points at one height")
PYTHON
