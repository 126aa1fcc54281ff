#!/usr/bin/env bash
# pyrealsense2 2.59.1 (librealsense) gives the points of one depth image in two frames. `get_vertices()` has the camera's: x to
# the right, y down, z ahead. What `export_to_ply` and the filter `save_to_ply` write of the same object has y up and z back, a
# half turn about x, as viewers draw it, and leaves the pixels without a depth out. The file's only comment names the Viewer.
#
# Guess before it was run: a file of an object's points holds these points.
# For whom it matters: whoever calibrates a camera with a LiDAR, or keeps extrinsics of the depth camera, and saves clouds to
# register them: a pose of the file differs from that of the array by half a turn. Of two cameras' files the pose T is not the one
# between the cameras' frames either; that is D T D, with D = diag(1, -1, -1, 1).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pyrealsense2==2.59.1.11053" "libusb-package==1.0.30.0" "plyfile==1.1.5" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import ctypes
from importlib.metadata import version

import libusb_package  # stands in for the system's, which the wheel needs
import numpy as np
from plyfile import PlyData

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
import pyrealsense2 as rs

WIDTH, HEIGHT = 64, 48
lens = rs.intrinsics()
lens.width, lens.height, lens.ppx, lens.ppy, lens.fx, lens.fy = WIDTH, HEIGHT, 32.0, 24.0, 60.0, 60.0
lens.model, lens.coeffs = rs.distortion.none, [0.0] * 5
stream = rs.video_stream()
stream.type, stream.index, stream.uid, stream.fps, stream.bpp = rs.stream.depth, 0, 0, 30, 2
stream.width, stream.height, stream.fmt, stream.intrinsics = WIDTH, HEIGHT, rs.format.z16, lens
camera = rs.software_device()
sensor = camera.add_sensor("Depth")
profile = sensor.add_video_stream(stream)
sensor.add_read_only_option(rs.option.depth_units, 0.001)
camera.create_matcher(rs.matchers.default)
arrived = rs.syncer()
sensor.open(profile)
sensor.start(arrived)

depth = np.full((HEIGHT, WIDTH), 2000, np.uint16)  # millimetres: two walls
depth[:, 40:] = 3000
depth[:5, :5] = 0
image = rs.software_video_frame()
image.pixels, image.stride, image.bpp, image.frame_number, image.timestamp = depth, 2 * WIDTH, 2, 1, 0.0
image.domain, image.profile = rs.timestamp_domain.hardware_clock, profile.as_video_stream_profile()
image.depth_units = 0.001
sensor.on_video_frame(image)
frames = arrived.wait_for_frames()
points = rs.pointcloud().calculate(frames.get_depth_frame())
vertices = np.asarray(points.get_vertices()).view(np.float32).reshape(-1, 3)
points.export_to_ply("exported.ply", frames.get_depth_frame())
rs.save_to_ply("saved.ply").process(frames)

print("pyrealsense2", version("pyrealsense2"), "plyfile", version("plyfile"), "numpy", np.__version__)
seen = vertices[vertices[:, 2] > 0.0]
print(f"  get_vertices(): {len(vertices)} points, of which {len(seen)} have a depth, z from {seen[:, 2].min()} to {seen[:, 2].max():.0f}")
for name in ("exported.ply", "saved.ply"):
    rows = PlyData.read(name)["vertex"]
    written = np.column_stack([rows["x"], rows["y"], rows["z"]])
    print(f"  {name}: {len(written)} points, z from {written[:, 2].min():.0f} to {written[:, 2].max():.0f}")
    assert written.shape == seen.shape and np.abs(written - seen * [1.0, -1.0, -1.0]).max() < 1e-5, "pyrealsense2 no longer does this"
assert len(vertices) == WIDTH * HEIGHT and np.isclose(seen[:, 2].min(), 2.0)
print("y and z have changed their signs")
PYTHON
