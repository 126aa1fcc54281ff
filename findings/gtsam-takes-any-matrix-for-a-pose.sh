#!/usr/bin/env bash
# gtsam 4.3.0's `Pose3(matrix)` looks at nothing: a similarity, a mirror image, a rotation rounded to two digits and a
# transposed matrix (rows times matrix, as graphics and some tools write it) all become a pose. `transformFrom` then uses
# the matrix as it is, `transformTo` and `inverse` its transpose, so that one no longer undoes the other, and `Logmap`
# calls a doubling of the size and a mirror image the identity. Of the transposed matrix the translation is gone.
#
# Guess before it was run: an exception for what is no rotation, or the nearest rotation.
# For whom it matters: whoever hands it matrices of other programs, of photogrammetry above all, or from text with few
# digits: a pose graph of them is optimised without a word. Check `R @ R.T` and the last row first, and make the rotation
# exact with an SVD, or by `Rot3.ClosestTo`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "gtsam==4.3.0" "numpy<2.4"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import gtsam
import numpy as np

pose = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.2, -0.4, 0.6), np.array([3.0, -2.0, 1.0])).matrix()
rounded = pose.copy()
rounded[:3, :3] = np.round(rounded[:3, :3], 2)
given = {
    "a pose": pose,
    "twice the size": np.diag([2.0, 2.0, 2.0, 1.0]),
    "a mirror image": np.diag([1.0, 1.0, -1.0, 1.0]),
    "two digits": rounded,
    "transposed": pose.T,
}
point = np.array([1.0, 2.0, 3.0])
print("gtsam", version("gtsam"), "numpy", np.__version__)
off, log, place = {}, {}, {}
for words, matrix in given.items():
    taken = gtsam.Pose3(matrix)
    off[words] = float(np.linalg.norm(taken.transformTo(taken.transformFrom(point)) - point))
    log[words] = float(np.linalg.norm(gtsam.Pose3.Logmap(taken)))
    place[words] = taken.translation()
    print(f"  {words}: accepted; there and back a point is {off[words]:.4f} m off; |log| {log[words]:.3f}; at {place[words]}")
closest = gtsam.Rot3.ClosestTo(rounded[:3, :3]).matrix()
print(f"  Rot3.ClosestTo of two digits: R R^T is off by {np.abs(closest @ closest.T - np.eye(3)).max():.0e}")
assert off["a pose"] < 1e-12 and np.abs(closest @ closest.T - np.eye(3)).max() < 1e-12
assert off["twice the size"] > 1.0 and off["two digits"] > 1e-3, "gtsam no longer does this"
assert log["twice the size"] == log["a mirror image"] == 0.0, "gtsam no longer does this"
assert not place["transposed"].any(), "gtsam no longer does this"
print("what is no rigid motion passes for one")
PYTHON
