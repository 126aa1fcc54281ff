#!/usr/bin/env bash
# gtsam 4.3.0's `writeG2o` writes six digits of every number. A trajectory in a map's grid (UTM northings are millions of
# metres) comes back from `readG2o` with its poses up to five metres off, each by another amount, and with neighbours at
# one place; ten kilometres off the origin it is seven millimetres. The edges between them hold their few metres to the
# micron, so that the graph's error, next to nothing before, is large after. Nothing is raised.
#
# Guess before it was run: text of doubles holds 17 digits, and what was written is what is read.
# For whom it matters: whoever saves a georeferenced pose graph, for a start or a comparison, or takes a .g2o file's
# vertices for a trajectory. Subtract the first pose's position before writing, and add it after reading.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "gtsam==4.3.0" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import gtsam
import numpy as np

STEPS = 40
print("gtsam", version("gtsam"), "numpy", version("numpy"))
moved, together, errors = {}, {}, {}
for where, offset in (
    ("at the origin", np.zeros(3)),
    ("10 km off", np.array([6_000.0, 8_000.0, 100.0])),
    ("in a map's grid", np.array([512_345.0, 5_412_345.0, 123.0])),
):
    # A drive along a bend, a metre and a quarter from pose to pose, and the edges between them.
    step = gtsam.Pose3(gtsam.Rot3.Rz(np.radians(2.0)), np.array([1.2345678, 0.0, 0.01]))
    poses = [gtsam.Pose3(gtsam.Rot3.Rz(0.3), offset + [0.123456, 0.234567, 0.345678])]
    while len(poses) < STEPS:
        poses.append(poses[-1].compose(step))
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([0.01, 0.01, 0.01, 0.05, 0.05, 0.05]))
    for row, pose in enumerate(poses):
        values.insert(row, pose)
        if row:
            graph.add(gtsam.BetweenFactorPose3(row - 1, row, step, noise))
    gtsam.writeG2o(graph, values, "graph.g2o")
    again, read = gtsam.readG2o("graph.g2o", True)
    before = np.array([pose.translation() for pose in poses])
    after = np.array([read.atPose3(row).translation() for row in range(STEPS)])
    moved[where] = np.linalg.norm(after - before, axis=1).max()
    together[where] = int(np.sum(np.linalg.norm(np.diff(after, axis=0), axis=1) < 0.5))
    errors[where] = graph.error(values), again.error(read)
    print(f"{where}: a pose moves by up to {moved[where]:.6f} m; error {errors[where][0]:.3g}, then {errors[where][1]:.3g};")
    print(f"  {together[where]} of {STEPS - 1} steps are shorter than 0.5 m")

changed = "gtsam no longer does this"
assert moved["at the origin"] < 1e-3, "gtsam loses more than digits"
assert 0.005 < moved["10 km off"] < 0.2 and moved["in a map's grid"] > 2.0, changed
assert together["at the origin"] == 0 and together["in a map's grid"] > 10, changed
assert errors["in a map's grid"][0] < 1e-3 and errors["in a map's grid"][1] > 1000.0, changed
print("poses are written with six digits")
PYTHON
