#!/usr/bin/env bash
# ouster-sdk 1.0.1's `interp_pose(times, known_times, poses)` refuses times out of order and repeated ones, but not times before the
# first pose or after the last: there it goes on with the motion between the two poses at that end, as far as one likes. Two
# poses, a tenth of a second and a centimetre's noise apart, put a sensor that stands still 1 m away ten seconds later, and a slight
# turn between them goes round and round. scipy's `Slerp` refuses such times, and so does the SDK's own `pose_at_timestamp`.
#
# Guess before it was run: it raises, or stays at the last pose.
# For whom it matters: whoever undoes the motion in scans with a trajectory of another source (`interp_pose`, then `dewarp`): a
# log that starts later, stops earlier, or has another clock makes scans that are bent, or lie anywhere, without a word.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "ouster-sdk==1.0.1" "scipy==1.17.1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from ouster.sdk.core import interp_pose
from scipy.spatial.transform import Rotation, Slerp

seconds = np.array([0.0, 0.1])
poses = np.tile(np.eye(4), (2, 1, 1))
poses[1, 0, 3] = 0.01  # a centimetre of noise, and half a degree
poses[1, :3, :3] = Rotation.from_euler("z", 0.5, degrees=True).as_matrix()


def angle(pose):
    return Rotation.from_matrix(pose[:3, :3]).magnitude() * 180.0 / np.pi


print("ouster-sdk", version("ouster-sdk"), "scipy", version("scipy"), "numpy", np.__version__)
inside, later, before = interp_pose(np.array([0.05]), seconds, poses)[0], *(
    interp_pose(np.array([time]), seconds, poses)[0] for time in (10.1, -10.0)
)
for words, pose in (("between the poses", inside), ("10 s after the last", later), ("10 s before the first", before)):
    print(f"  {words}: {np.linalg.norm(pose[:3, 3]):.3f} m and {angle(pose):.1f} degrees from the start")
try:
    Slerp(seconds, Rotation.from_matrix(poses[:, :3, :3]))([10.1])
    scipy_refuses = False
except ValueError:
    scipy_refuses = True
try:
    interp_pose(np.array([0.05]), seconds[::-1].copy(), poses)
    order_counts = False
except ValueError:
    order_counts = True
print(f"  refuses times out of order: {order_counts}; scipy's Slerp refuses times beyond: {scipy_refuses}")
assert angle(inside) < 0.5 and order_counts and scipy_refuses
assert angle(later) > 40.0 and angle(before) > 40.0, "ouster-sdk no longer goes on beyond the poses"
assert np.linalg.norm(later[:3, 3]) > 0.9
print("ouster's interp_pose goes on beyond the poses")
PYTHON
