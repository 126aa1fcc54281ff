#!/usr/bin/env bash
# g2o 0.0.12 (its Python package g2o-python) and gtsam 4.3.0 take one edge `EDGE_SE3:QUAT` for two: g2o's error is the vector
# part of a quaternion, half the angle, and gtsam's is the angle. The same information matrix in one `.g2o` file therefore
# weighs rotations four times as much in gtsam as in g2o; translations weigh the same.
#
# Guess before it was run: the same chi-square, an angle of 0.1 with information 1 giving 0.01 in both.
# For whom it matters: whoever writes relative poses and their covariances to a `.g2o` file: which of the two reads it
# decides how far rotations may give way. For g2o multiply the rotational block of the information by four, and the mixed
# blocks by two, where it is the inverse covariance of a rotation vector.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "g2o-python==0.0.12" "gtsam==4.3.0" "numpy<2"
cd "$folder"
cat > with_g2o.py <<'PYTHON'
import sys

import g2o
import numpy as np

angle, step = map(float, sys.argv[1:])
c, s = np.cos(angle), np.sin(angle)
turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
graph = g2o.SparseOptimizer()
graph.set_algorithm(g2o.OptimizationAlgorithmLevenberg(g2o.BlockSolverSE3(g2o.LinearSolverEigenSE3())))
for k, (R, t) in enumerate(((np.eye(3), np.zeros(3)), (turned, np.array([1.0 + step, 0.0, 0.0])))):
    vertex = g2o.VertexSE3()
    vertex.set_id(k)
    vertex.set_estimate(g2o.Isometry3d(R, t))
    graph.add_vertex(vertex)
edge = g2o.EdgeSE3()
edge.set_vertex(0, graph.vertex(0))
edge.set_vertex(1, graph.vertex(1))
edge.set_measurement(g2o.Isometry3d(np.eye(3), np.array([1.0, 0.0, 0.0])))
edge.set_information(np.eye(6))
graph.add_edge(edge)
edge.compute_error()
print(edge.chi2())
PYTHON
cat > with_gtsam.py <<'PYTHON'
import sys

import gtsam
import numpy as np

angle, step = map(float, sys.argv[1:])
ones = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1"
with open("edge.g2o", "w") as file:
    file.write("VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\n")
    file.write(f"VERTEX_SE3:QUAT 1 {1.0 + step} 0 0 0 0 {np.sin(angle / 2)} {np.cos(angle / 2)}\n")
    file.write(f"EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 {ones}\n")
graph, values = gtsam.readG2o("edge.g2o", True)
print(2.0 * graph.error(values))
PYTHON
"$folder/env/bin/python" - <<'PYTHON'
import subprocess
import sys
from importlib.metadata import version

print("g2o-python", version("g2o-python"), "gtsam", version("gtsam"), "numpy", version("numpy"))
for what, angle, step in (("a rotation of 0.1", 0.1, 0.0), ("a translation of 0.1", 0.0, 0.1)):
    chi = []
    for script in ("with_g2o.py", "with_gtsam.py"):
        ran = subprocess.run([sys.executable, script, str(angle), str(step)], capture_output=True, text=True, check=True)
        chi.append(float(ran.stdout.split()[-1]))
    print(f"  {what}, information 1: chi-square {chi[0]:.6f} in g2o, {chi[1]:.6f} in gtsam")
    expected = 4.0 if angle else 1.0
    assert abs(chi[1] / chi[0] - expected) < 0.01, "they no longer do this"
print("one file, two weights")
PYTHON
