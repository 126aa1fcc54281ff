#!/usr/bin/env bash
# carla 0.9.16's `Transform.transform(point)`, `transform_vector` and `inverse_transform` return the moved point, and write
# it into the point that was given as well. A second call with the same point moves it once more.
#
# Guess before it was run: the point that is given stays what it was, as a matrix product leaves its vector.
# For whom it matters: whoever carries one point of a simulated sensor into several frames to make true poses: from the second
# frame on the point is another one. Pass a copy, `carla.Location(point.x, point.y, point.z)`, or use `get_matrix()` and numpy.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "carla==0.9.16" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import carla
import numpy as np

pose = carla.Transform(carla.Location(x=1.0, y=2.0, z=3.0), carla.Rotation(pitch=10.0, yaw=20.0, roll=30.0))
start = np.array([0.3, -2.0, 1.5])
M = np.array(pose.get_matrix())
right = {
    "transform": M[:3, :3] @ start + M[:3, 3],
    "transform_vector": M[:3, :3] @ start,
    "inverse_transform": (start - M[:3, 3]) @ M[:3, :3],
}


def numbers(point: carla.Vector3D) -> np.ndarray:
    return np.array([point.x, point.y, point.z])


print("carla", version("carla"))
for name, wanted in right.items():
    point = carla.Location(*start)
    first = numbers(getattr(pose, name)(point))
    after = numbers(point)
    second = numbers(getattr(pose, name)(point))
    print(f"{name}: given {start}, returned {first.round(3)}, the given point now {after.round(3)}")
    print(f"  the same call again: {second.round(3)}, {np.linalg.norm(second - first):.2f} m away")
    assert np.allclose(first, wanted, atol=1e-4), "the first answer is no longer the pose's"
    assert np.allclose(after, first), "the given point stays what it was"
    assert np.linalg.norm(second - first) > 0.5
PYTHON
