#!/usr/bin/env bash
# ros2-numpy 0.0.5, as the Python index has it, reads a PointCloud2 by its own idea of one: x, y and z are the first twelve
# bytes of each point, whatever the fields' offsets and types say, and `rgb` and `intensity` begin at the byte whose number
# is the field's place in the list: the fourth field at byte 3, inside x. Intensities are read as two bytes of those, colours as
# three. Nothing is raised.
#
# Guess before it was run: each field at its offset, in its type, as the message says (noted after the code was read).
# For whom it matters: whoever installs it where there is no ROS to install it from, and colours, filters or weighs points by intensity;
# and whoever has clouds with doubles, or with a field before x. `rosbags` or `pointcloud2` read the fields.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "transformations==2026.1.18" "pybase64==1.5.1" "rosbags==0.11.9" "numpy<2.5"
# It asks for one version of numpy, which has no wheel for newer interpreters.
"$folder/env/bin/python" -m pip install --quiet --no-deps "ros2-numpy==0.0.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import sys
from importlib.metadata import version
from types import ModuleType

import numpy as np
from rosbags.typesys import Stores, get_typestore

types = get_typestore(Stores.ROS2_HUMBLE).types
# Messages without ROS: rosbags has its types.
for package in ("sensor_msgs", "nav_msgs", "geometry_msgs"):
    module = sys.modules[f"{package}.msg"] = ModuleType(f"{package}.msg")
    sys.modules[package] = ModuleType(package)
    for name, kind in types.items():
        if name.startswith(f"{package}/msg/"):
            setattr(module, name.rpartition("/")[2], kind)
import ros2_numpy  # noqa: E402

CODES = {"f4": 7, "f8": 8, "u4": 6}
points = np.random.default_rng(0).uniform(-20.0, 20.0, (100, 3)).astype("f4")
bright = np.linspace(0.0, 255.0, 100)


def message(fields):
    record = np.zeros(100, dtype=[(name, f"<{kind}") for name, kind in fields])
    for axis, name in enumerate("xyz"):
        record[name] = points[:, axis]
    record["intensity"] = bright
    told = [
        types["sensor_msgs/msg/PointField"](name=name, offset=record.dtype.fields[name][1], datatype=CODES[kind], count=1)
        for name, kind in fields
    ]
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    return types["sensor_msgs/msg/PointCloud2"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="lidar"),
        height=1,
        width=100,
        fields=told,
        is_bigendian=False,
        point_step=record.itemsize,
        row_step=record.nbytes,
        data=np.frombuffer(record.tobytes(), np.uint8),
        is_dense=True,
    )


axes = [(axis, "f4") for axis in "xyz"]
cases = {
    "x y z intensity": [*axes, ("intensity", "f4")],
    "a time before x": [("t", "u4"), *axes, ("intensity", "f4")],
    "doubles": [*((axis, "f8") for axis in "xyz"), ("intensity", "f4")],
}
print("ros2-numpy", version("ros2-numpy"), "rosbags", version("rosbags"), "numpy", np.__version__)
right = {}
for words, fields in cases.items():
    found = ros2_numpy.numpify(message(fields))
    places = found["xyz"].shape == points.shape and bool(np.allclose(found["xyz"], points, atol=1e-6))
    shades = bool(np.allclose(np.ravel(found["intensity"]), bright, atol=1.0))
    right[words] = places, shades
    print(f"  {words}: places right: {places}, intensities right: {shades} ({np.ravel(found['intensity'])[:3]}, sent {bright[:3].round(1)})")
assert right["x y z intensity"] == (True, False), "ros2-numpy no longer does this"
assert not right["a time before x"][0] and not right["doubles"][0], "ros2-numpy no longer does this"
print("fields are read where they are not")
PYTHON
