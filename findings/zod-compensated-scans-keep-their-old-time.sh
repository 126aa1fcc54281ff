#!/usr/bin/env bash
# zod 0.8.0's `motion_compensate_scanwise` and `motion_compensate_pointwise` move a scan to where the sensor stood at
# `target_timestamp`, and leave `core_timestamp` and the times of the points as they were. Both begin at those times, so
# that a second call does not go on from the first: it moves the points again by the motion since the old time. A scan
# that is brought to another moment and back does not come back. At 20 m/s, by 0.3 s and then 0.2 s, it is 6 m off.
# `extend` then gives several scans a mean time in which the first one counts too much.
#
# Guess before it was run: `extend` gives the mean time, weighted by the points; of the compensation: the scan that is given back has
# the time that it was moved to (noted after the code was read).
# For whom it matters: whoever brings what `get_aggregated_lidar(timestamp=...)` or one call gave to the moment of another
# sensor before the two are registered. Set `core_timestamp` and `timestamps` of the result to the target by hand.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "zod==0.8.0" "dataclass-wizard==0.35.0" "numpy-quaternion==2024.0.13" \
    "scipy==1.17.1" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version
from types import SimpleNamespace

import numpy as np
from zod.data_classes.ego_motion import EgoMotion
from zod.data_classes.geometry import Pose
from zod.data_classes.sensor import LidarData
from zod.utils.compensation import motion_compensate_pointwise, motion_compensate_scanwise

SPEED = 20.0  # m/s, straight ahead
times = np.linspace(0.0, 1.0, 11)
poses = np.tile(np.eye(4), (11, 1, 1))
poses[:, 0, 3] = SPEED * times
still = np.zeros((11, 3))
ego = EgoMotion(poses, still, still, still, times, (0.0, 0.0))
calibration = SimpleNamespace(extrinsics=Pose(np.eye(4)))
pole = np.array([[50.0, 0.0, 0.0]])


def seen_at(time, count=1):
    points = np.repeat(pole - [SPEED * time, 0.0, 0.0], count, axis=0)
    zeros = np.zeros(count, np.uint8)
    return LidarData(points, np.full(count, time), zeros, zeros, time)


print("zod", version("zod"), "numpy", np.__version__)
off = {}
for compensate in (motion_compensate_scanwise, motion_compensate_pointwise):
    once = compensate(seen_at(0.2), ego, calibration, 0.5)
    twice = compensate(once, ego, calibration, 0.7)
    back = compensate(once, ego, calibration, 0.2)
    moved = {"once, to 0.5 s": (once, 0.5), "then to 0.7 s": (twice, 0.7), "or back to 0.2 s": (back, 0.2)}
    print(f"  {compensate.__name__} of a scan of 0.2 s, whose time then is {once.core_timestamp} s")
    for words, (scan, time) in moved.items():
        error = float(np.abs(scan.points - seen_at(time).points).max())
        off[compensate.__name__, words] = error
        print(f"    {words}: {error:.3f} m off")
    assert once.core_timestamp == 0.2, "zod now sets the time"
    by_hand = LidarData(once.points, np.array([0.5]), once.intensity, once.diode_idx, 0.5)
    assert np.allclose(compensate(by_hand, ego, calibration, 0.7).points, seen_at(0.7).points)
both = seen_at(0.2, 1000)
both.extend(seen_at(0.5, 1000))
print(f"  1000 points of 0.2 s, extended by 1000 of 0.5 s: {both.core_timestamp:.3f} s")
for name in ("motion_compensate_scanwise", "motion_compensate_pointwise"):
    assert off[name, "once, to 0.5 s"] < 1e-9
    assert abs(off[name, "then to 0.7 s"] - 6.0) < 1e-6 and abs(off[name, "or back to 0.2 s"] - 6.0) < 1e-6
assert abs(both.core_timestamp - 0.3) < 1e-9, "zod's extend no longer does this"
print("a compensated scan still says its old time")
PYTHON
