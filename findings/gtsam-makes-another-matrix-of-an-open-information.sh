#!/usr/bin/env bash
# gtsam 4.3.0's `noiseModel.Gaussian.Information(H)` makes another matrix of an information that leaves a direction open, and says
# nothing. In a straight corridor along x a registration says nothing of x: the Cholesky decomposition meets a zero there, stops, and
# what stands behind it, y and z here, keeps the raw entries of H in place of their roots. A centimetre across the corridor weighs half
# a million times too much, as if the walls were known to two micrometres, and other measurements count no more. numpy's `cholesky`
# raises. With the corridor turned, rounding decides: at 30 degrees the matrix is right. `Gaussian.Covariance` of a rank too low gives
# numbers of 1e14 or more.
#
# Guess before it was run: it raises, or it is right and leaves the direction free.
# For whom it matters: whoever puts results of a registration into a graph with the Hessian of its last step (small_gicp's `H`, or J^T J
# of points and planes) as their information: tunnels, corridors, fields and single walls are where it is open. Add a little to the
# diagonal, or see that `model.information()` is H.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "gtsam==4.3.0" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import gtsam
import numpy as np

SIGMA = 0.02  # metres, of a point's distance from its wall


def information(yaw_deg):
    """J^T J of 300 points on the floor and on both walls of a corridor, rotation first as in gtsam."""
    rng = np.random.default_rng(0)
    turn = gtsam.Rot3.Rz(np.radians(yaw_deg)).matrix()
    rows = []
    for k in range(300):
        if k % 3:
            point, normal = [rng.uniform(-10, 10), rng.choice([-2, 2]), rng.uniform(-1, 2)], [0, 1, 0]
        else:
            point, normal = [rng.uniform(-10, 10), rng.uniform(-2, 2), -1], [0, 0, 1]
        if yaw_deg:
            point, normal = turn @ point, turn @ normal
        rows.append([*np.cross(point, normal), *normal])
    J = np.array(rows, dtype=float)
    return J.T @ J / SIGMA**2


print("gtsam", version("gtsam"), "numpy", np.__version__)
for yaw in (0, 30):
    H = information(yaw)
    kept = gtsam.noiseModel.Gaussian.Information(H).information()
    step = 0.01**2
    words = "; ".join(f"{axis} {kept[k, k] * step:.0f} for {H[k, k] * step:.0f}" for axis, k in zip("xyz", (3, 4, 5)))
    print(f"  along {yaw} degrees, the weight of a centimetre: {words}")
H = information(0)
model = gtsam.noiseModel.Gaussian.Information(H)
# The registration says y = 0, a total station y = 5 mm, twice as surely as the walls are known.
wall = np.linalg.inv(H + np.diag([0, 0, 0, 1e-6, 0, 0]))[4, 4] ** 0.5
station = gtsam.noiseModel.Diagonal.Sigmas([1.0, 1.0, 1.0, 1.0, wall / 2, 1.0])
graph, start = gtsam.NonlinearFactorGraph(), gtsam.Values()
graph.add(gtsam.PriorFactorPose3(0, gtsam.Pose3(), model))
graph.add(gtsam.PriorFactorPose3(0, gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.005, 0.0])), station))
start.insert(0, gtsam.Pose3())
y = gtsam.LevenbergMarquardtOptimizer(graph, start).optimize().atPose3(0).translation()[1]
right = np.linalg.solve(H + station.information(), station.information() @ [0, 0, 0, 0, 0.005, 0])[4]
print(f"  walls known to {1000 * wall:.2f} mm, a station twice as sure 5 mm aside: y is {1000 * y:.4f} mm, by hand {1000 * right:.2f}")
try:
    np.linalg.cholesky(H)
    raised = False
except np.linalg.LinAlgError:
    raised = True
assert raised and np.allclose(H[3], 0.0) and abs(right - 0.004) < 2e-4
kept = model.information()
assert kept[4, 4] > 1e5 * H[4, 4] and kept[5, 5] > 1e5 * H[5, 5] and y < 1e-5, "gtsam now keeps or refuses it"
print("an open direction makes the others certain")
PYTHON
