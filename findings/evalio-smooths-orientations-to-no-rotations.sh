#!/usr/bin/env bash
# evalio 0.6.1's `Trajectory.smooth_orientation` turns each pose towards the next one. On a slope its axes are no rotation: the
# sideways axis is the cross product of the vertical and the direction, which is shorter than 1 there, and the third one
# shorter still. `SO3.from_mat` takes what a quaternion can hold of them, so that the forward axis misses the direction,
# here by 3 degrees where the path climbs at 30, by 8 at 45 and by 17 at 60, and `to_mat` gives a matrix that shrinks
# what it turns.
#
# Guess before it was run: rotations whose x axis is the direction of motion, uphill as well (noted after the code was read).
# For whom it matters: whoever gives GNSS tracks or total station prisms their orientations with it, to compare an odometry's
# or to lay scans out: drones, stairs and ramps. Normalise the sideways axis: numpy and scipy's `Rotation` do in two lines.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "evalio==0.6.1" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from evalio.types import SE3, SO3, Stamp, Trajectory

print("evalio", version("evalio"), "numpy", np.__version__)
off, shrink = {}, {}
for slope in (0.0, 30.0, 45.0, 60.0):
    climb, heading = np.radians(slope), np.radians(50.0)
    forward = np.array([np.cos(climb) * np.cos(heading), np.cos(climb) * np.sin(heading), np.sin(climb)])
    poses = [SE3(SO3.identity(), k * forward) for k in range(20)]
    track = Trajectory(stamps=[Stamp.from_sec(float(k)) for k in range(20)], poses=poses)
    turned = track.smooth_orientation("x", "up", inplace=False).poses[5].rot.to_mat()
    x = turned[:, 0] / np.linalg.norm(turned[:, 0])
    off[slope] = float(np.degrees(np.arccos(np.clip(x @ forward, -1.0, 1.0))))
    shrink[slope] = float(np.linalg.det(turned))
    side = np.cross([0.0, 0.0, 1.0], forward)
    side /= np.linalg.norm(side)
    cured = np.column_stack([forward, side, np.cross(forward, side)])
    assert np.allclose(SO3.from_mat(np.asfortranarray(cured)).to_mat()[:, 0], forward)
    print(f"  a straight path that climbs at {slope:.0f} deg: x is {off[slope]:.2f} deg off it, determinant {shrink[slope]:.3f}")
assert off[0.0] < 1e-4 and abs(shrink[0.0] - 1.0) < 1e-9
assert off[30.0] > 3.0 and off[45.0] > 8.0, "evalio no longer does this"
assert shrink[45.0] < 0.9, "evalio no longer does this"
print("uphill its orientations are no rotations")
PYTHON
