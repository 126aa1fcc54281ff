#!/usr/bin/env bash
# pypcd4 1.5.1's `PointCloud.from_msg` looks neither at `is_bigendian` nor at `row_step` of a PointCloud2. A big-endian cloud
# becomes numbers near zero or of 1e38, without a word. Of an organised cloud whose rows are padded, the padding becomes
# points where it is as long as a point, and is an error of numpy's otherwise. `to_msg` writes one row, whatever the height.
#
# Guess before it was run: the points of the message, as sensor_msgs describes them.
# For whom it matters: whoever turns bags into PCD files: cameras' and drivers' clouds that are cropped or aligned in memory
# have padded rows, and big-endian recorders exist. Check `is_bigendian` and `row_step == width * point_step` first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pypcd4==1.5.1" "rosbags==0.11.9" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pypcd4 import PointCloud
from rosbags.typesys import Stores, get_typestore

types = get_typestore(Stores.ROS2_HUMBLE).types
rows, columns = 4, 10
points = np.random.default_rng(0).uniform(-20.0, 20.0, (rows, columns, 3)).astype("f4")


def message(order="<", padding=0):
    """A PointCloud2 of x, y and z, each row with so many bytes behind it."""
    lines = [line.astype(f"{order}f4").tobytes() + bytes(padding) for line in points]
    fields = [
        types["sensor_msgs/msg/PointField"](name=axis, offset=4 * k, datatype=7, count=1) for k, axis in enumerate("xyz")
    ]
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    return types["sensor_msgs/msg/PointCloud2"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="lidar"),
        height=rows,
        width=columns,
        fields=fields,
        is_bigendian=order == ">",
        point_step=12,
        row_step=12 * columns + padding,
        data=np.frombuffer(b"".join(lines), np.uint8),
        is_dense=True,
    )


print("pypcd4", version("pypcd4"), "rosbags", version("rosbags"), "numpy", np.__version__)
cases = {
    "plain": message(),
    "big endian": message(order=">"),
    "rows padded by a point": message(padding=12),
    "rows padded by a word": message(padding=4),
}
seen = {}
for name, each in cases.items():
    try:
        found = PointCloud.from_msg(each).numpy(("x", "y", "z"))
        same = np.array_equal(found, points.reshape(-1, 3))
        seen[name] = (len(found), same)
        print(f"  {name}: {len(found)} of {rows * columns} points, as in the message: {same}, the second {found[1]}")
    except ValueError as error:
        seen[name] = None
        print(f"  {name}: {error}")
back = PointCloud.from_msg(cases["plain"]).to_msg()
print(f"  plain, and back to a message: {back.height} x {back.width}")
assert seen["plain"] == (40, True)
assert seen["big endian"] == (40, False), "pypcd4 no longer does this"
assert seen["rows padded by a point"] is not None and not seen["rows padded by a point"][1], "pypcd4 no longer does this"
assert seen["rows padded by a word"] is None, "pypcd4 no longer does this"
print("one layout is read, whatever the message says")
PYTHON
