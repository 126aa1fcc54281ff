#!/usr/bin/env bash
# kiss-icp 1.3.0's `read_point_cloud`, which its loaders of ROS bags and MCAP use, leaves out the points of a PointCloud2 that are
# NaN, and leaves the times of all points as they were. `register_frame` takes both without a word, and gives the points the
# first so many times in their order. A scan with as many missing returns as returns, sky as a rule, is undistorted as if
# it had been over in half the time: at 20 m/s its last points are moved a metre too far. genz-icp 0.3.2 does the same.
#
# Guess before it was run: points and times of one length, as its description has them (noted after the code was read).
# For whom it matters: whoever runs it on clouds of organised drivers, which write NaN for no return (`is_dense` false), and lays the
# scans beside others. Leave NaN points out of the messages first, or call the loader's `read_points` and mask both.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "kiss-icp==1.3.0" "genz-icp==0.3.2" "rosbags==0.11.9" "numpy<2.3"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib import import_module
from importlib.metadata import version

import numpy as np
from kiss_icp.config import KISSConfig
from kiss_icp.preprocess import get_preprocessor
from rosbags.typesys import Stores, get_typestore

types = get_typestore(Stores.ROS2_HUMBLE).types
rows, columns, forward = 16, 1800, 2.0  # metres in one turn of a tenth of a second

# A pole field seen while driving: each column at its time, every second row looks into the sky.
turn = np.linspace(-np.pi, np.pi, columns, endpoint=False)
time = np.repeat(np.linspace(0.0, 1.0, columns)[:, None], rows, axis=1)
truth = np.empty((columns, rows, 3))  # from where the sensor is at the end of the turn
truth[..., 0] = 20.0 * np.cos(turn)[:, None]
truth[..., 1] = 20.0 * np.sin(turn)[:, None]
truth[..., 2] = np.linspace(-2.0, 2.0, rows)
seen = truth.copy()
seen[..., 0] += forward * (1.0 - time)
returned = np.ones((columns, rows), dtype=bool)
returned[:, 1::2] = False


def message(holes):
    record = np.zeros((columns, rows), dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("t", "<f4")])
    for axis, name in enumerate("xyz"):
        record[name] = np.where(returned, seen[..., axis], np.nan) if holes else seen[..., axis]
    record["t"] = time
    kept = record if holes else record[returned][:, None]
    fields = [
        types["sensor_msgs/msg/PointField"](name=name, offset=4 * k, datatype=7, count=1) for k, name in enumerate("xyzt")
    ]
    stamp = types["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    return types["sensor_msgs/msg/PointCloud2"](
        header=types["std_msgs/msg/Header"](stamp=stamp, frame_id="lidar"),
        height=kept.shape[0],
        width=kept.shape[1],
        fields=fields,
        is_bigendian=False,
        point_step=16,
        row_step=16 * kept.shape[1],
        data=np.frombuffer(kept.tobytes(), np.uint8),
        is_dense=not holes,
    )


config = KISSConfig()
config.data.max_range, config.data.min_range, config.data.deskew = 100.0, 0.5, True
config.mapping.voxel_size = 1.0
undistort = get_preprocessor(config).preprocess
motion = np.eye(4)
motion[0, 3] = forward
print("kiss-icp", version("kiss-icp"), "genz-icp", version("genz-icp"), "rosbags", version("rosbags"), "numpy", np.__version__)
counts, off = {}, {}
for words, holes in (("without the missing points", False), ("with them as NaN", True)):
    for package in ("kiss_icp", "genz_icp"):
        points, times = import_module(f"{package}.tools.point_cloud2").read_point_cloud(message(holes))
        counts[package, holes] = len(points), len(times)
        print(f"  {package}, {words}: {len(points)} points, {len(times)} times")
    points, times = import_module("kiss_icp.tools.point_cloud2").read_point_cloud(message(holes))
    still = undistort(points, times, motion)
    assert len(still) == returned.sum()
    off[holes] = np.linalg.norm(still - truth[returned], axis=1)
    print(f"    undistorted by kiss-icp: median {np.median(off[holes]):.2f} m and up to {off[holes].max():.2f} m off")
half, whole = int(returned.sum()), returned.size
for package in ("kiss_icp", "genz_icp"):
    assert counts[package, False] == (half, half)
    assert counts[package, True] == (half, whole), f"{package} no longer does this"
assert off[False].max() < 0.01
assert 0.9 < off[True].max() < 1.1, "kiss-icp no longer does this"
print("points are left out, and their times are not")
PYTHON
