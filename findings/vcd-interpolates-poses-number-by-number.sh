#!/usr/bin/env bash
# vcd 6.0.3, the tools of ASAM OpenLABEL, has `utils.interpolate_pose` for a pose between two that are labelled. It takes the mean of
# the 4x4 matrices, number by number. Half way through a turn of 60 degrees the result shrinks to 87 % in the plane of the turn,
# half way through one of 120 degrees to 50 %: it is no rigid motion. Before and at the first stamp, and after the last, it gives None.
#
# Guess before it was run: positions in a straight line, rotations on the sphere (the source was read before it was run).
# For whom it matters: whoever takes the pose of a sensor between two labelled ones, at a bend, as a start or a truth for a registration:
# clouds moved by it are smaller, though its position is right. Interpolate with scipy's Slerp.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "vcd==6.0.3" "numpy<2.4" "scipy<1.18"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from scipy.spatial.transform import Rotation, Slerp
from vcd import utils

print("vcd", version("vcd"), "numpy", np.__version__)
for degrees in (20.0, 60.0, 120.0):
    turns = Rotation.from_euler("z", [[0.0], [degrees]], degrees=True)
    poses = {}
    for stamp, turn, place in zip((0, 10), turns.as_matrix(), ([0.0, 0.0, 0.0], [4.0, 2.0, 0.0])):
        poses[stamp] = utils.create_pose(turn, np.array([place]).T)
    half = np.asarray(utils.interpolate_pose(poses, 5))
    true = Slerp([0, 10], turns)(5).as_matrix()
    long = float(np.linalg.norm(half[:3, 0]))
    off = 10.0 * float(np.linalg.norm((half[:3, :3] - true)[:, 0]))
    print(f"  a turn of {degrees:.0f} degrees: half way a metre is {long:.3f} m; a point 10 m ahead is {off:.2f} m off")
    assert np.allclose(half[:3, 3], [2.0, 1.0, 0.0])
    assert abs(long - np.cos(np.radians(degrees / 2.0))) < 1e-9, "vcd no longer does this"
ends = [utils.interpolate_pose(poses, stamp) for stamp in (0, 11)]
print(f"  at the first stamp and after the last: {ends}")
assert ends == [None, None], "vcd gives something at the ends now"
print("between two poses lies none")
PYTHON
