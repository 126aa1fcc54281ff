#!/usr/bin/env bash
# PyGLM 2.8.3 reads a matrix from a numpy array row by row, and from the same numbers as a nested list column by column:
# `glm.mat4(pose)` is the pose, and `glm.mat4(pose.tolist())` its transpose, whose translation is lost for a point, and whose rotation
# turns the other way. `numpy.array(matrix)` gives rows, `matrix.to_list()` columns.
#
# Guess before it was run: an array and its list give one matrix.
# For whom it matters: whoever draws clouds by a pose from a file (JSON has lists) or from a registration (an array): one of the two is
# shown elsewhere. Make an array of lists first: `glm.mat4(numpy.array(rows, numpy.float32))`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "PyGLM==2.8.3" "numpy<2.4" "scipy<1.18"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import glm
import numpy as np
from scipy.spatial.transform import Rotation

pose = np.eye(4, dtype=np.float32)
pose[:3, :3], pose[:3, 3] = Rotation.from_euler("z", 30.0, degrees=True).as_matrix(), [1.0, 2.0, 3.0]
point = glm.vec4(5.0, 0.0, 0.0, 1.0)
true = pose @ np.array([5.0, 0.0, 0.0, 1.0])
print("PyGLM", version("PyGLM"), "numpy", np.__version__)
print(f"  numpy: {true[:3].round(3)}")
ends = {}
for words, matrix in (("array", glm.mat4(pose)), ("list of its rows", glm.mat4(pose.tolist()))):
    ends[words] = np.array(matrix * point)
    print(f"  glm.mat4 of the {words}: {ends[words][:3].round(3)}")
    assert np.array_equal(np.array(matrix), np.array(matrix.to_list()).T), "PyGLM's way back is another now"
assert np.allclose(ends["array"], true, atol=1e-5), "PyGLM no longer does this"
assert np.allclose(ends["list of its rows"], pose.T @ np.array([5.0, 0.0, 0.0, 1.0]), atol=1e-5), "PyGLM no longer does this"
print("a list is the transpose of its array")
PYTHON
