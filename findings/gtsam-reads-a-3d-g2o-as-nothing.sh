#!/usr/bin/env bash
# gtsam 4.3.0's `readG2o(path)` takes a file for a plane one unless it is told `is3D=True`. Of a file whose vertices and edges are
# all `SE3:QUAT` it returns a graph of no factors and no values, without a word, and the optimizer runs over these and says
# that the error is 0. Of a file with both kinds it returns the plane ones alone; with `is3D=True` the others alone.
#
# Guess before it was run: the tags of the lines tell which it is; a file without any line of the kind raises.
# For whom it matters: whoever optimizes the trajectory of a LiDAR SLAM by a script: an error of 0 looks like a good end, and what
# is written back is an empty file. Other solvers of the field (g2o's own) go by the tags.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "gtsam==4.3.0" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import gtsam

unit = {n: " ".join("1" if i == j else "0" for i in range(n) for j in range(i, n)) for n in (3, 6)}
full = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1.2 0 0 0 0 0 1\n"
full += f"EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 {unit[6]}\n"
flat = f"VERTEX_SE2 10 0 0 0\nVERTEX_SE2 11 1.2 0 0\nEDGE_SE2 10 11 1 0 0 {unit[3]}\n"
Path("full.g2o").write_text(full)
Path("both.g2o").write_text(full + flat)


def read(path, **how):
    graph, values = gtsam.readG2o(path, **how)
    print(f"  readG2o({path}{', is3D=True' if how else ''}): {graph.size()} factors, {values.size()} values")
    return graph, values


print("gtsam", version("gtsam"))
graph, values = read("full.g2o")
whole = read("full.g2o", is3D=True)
plane, solid = read("both.g2o"), read("both.g2o", is3D=True)
optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values)
after = optimizer.optimize()
print(f"  optimized: {after.size()} values, error {optimizer.error()}")
assert (whole[0].size(), whole[1].size()) == (1, 2), "gtsam no longer reads the file as a solid one"
assert (graph.size(), values.size(), after.size()) == (0, 0, 0), "gtsam now reads the file, or tells"
assert optimizer.error() == 0.0
assert [each[1].size() for each in (plane, solid)] == [2, 2], "gtsam now reads both kinds of one file"
print("reads a 3d g2o as nothing")
PYTHON
