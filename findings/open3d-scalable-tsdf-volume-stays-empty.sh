#!/usr/bin/env bash
# Open3D 0.20.0's `ScalableTSDFVolume` stays empty, whatever is integrated: the point cloud, the mesh and the voxels that it
# gives have no points, and nothing is said. `UniformTSDFVolume` takes the same image rightly, and so did the scalable volume
# of 0.19.0 (not run here).
#
# Guess before it was run: of an image of a wall 2 m away, points within a millimetre of the wall.
# For whom it matters: whoever fuses depth images into a map to register with: an old script writes an empty file since
# the update. Use `open3d.t.geometry.VoxelBlockGrid` or `UniformTSDFVolume`, or stay at 0.19.0.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "open3d==0.20.0" "numpy<2.5" "libusb-package"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import ctypes

import libusb_package  # open3d's wheel links against libusb without bringing it

ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
from importlib.metadata import version

import numpy as np
import open3d as o3d

fusion = o3d.pipelines.integration
colour, camera = fusion.TSDFVolumeColorType.RGB8, o3d.camera.PinholeCameraIntrinsic(320, 240, 224.0, 224.0, 159.5, 119.5)
print("open3d", version("open3d"), "numpy", np.__version__)
counts = {"scalable": [], "uniform": []}
for metres in (1.0, 2.0, 2.3):
    image = o3d.geometry.RGBDImage.create_from_color_and_depth(
        o3d.geometry.Image(np.zeros((240, 320, 3), np.uint8)),
        o3d.geometry.Image(np.full((240, 320), 1000 * metres, np.uint16)),
        depth_scale=1000.0,
        depth_trunc=10.0,
        convert_rgb_to_intensity=False,
    )
    assert np.allclose(np.asarray(image.depth), metres)
    volumes = {
        "scalable": fusion.ScalableTSDFVolume(voxel_length=0.04, sdf_trunc=0.16, color_type=colour),
        "uniform": fusion.UniformTSDFVolume(
            length=8.0, resolution=200, sdf_trunc=0.16, color_type=colour, origin=np.array([-4.0, -4.0, -1.0])
        ),
    }
    for name, volume in volumes.items():
        volume.integrate(image, camera, np.eye(4))
        points = np.asarray(volume.extract_point_cloud().points)
        corners = len(volume.extract_triangle_mesh().vertices)
        counts[name].append(len(points))
        middle = f", their mean z {points[:, 2].mean():.4f}" if len(points) else ""
        print(f"  a wall at {metres} m, {name} volume: {len(points)} points{middle}, {corners} corners of a mesh")
        assert not len(points) or abs(points[:, 2].mean() - metres) < 1e-3
assert min(counts["uniform"]) > 500
assert max(counts["scalable"]) == 0, "open3d no longer does this"
print("a volume of voxels that takes nothing")
PYTHON
