#!/usr/bin/env bash
# Open3D 0.20.0 puts pixel 0 at 0 in one half of its functions, and at 0.5 in the other, for the same intrinsic matrix:
# `RaycastingScene.create_rays_pinhole` and `VoxelBlockGrid.integrate` go through 0.5, `create_from_depth_image` of both kinds
# of clouds, `UniformTSDFVolume` and `VoxelBlockGrid.ray_cast` through 0. A depth image that the scene makes comes back as a
# cloud half a pixel aside, 15 mm at 6 m for a focal length of 200 pixels; a grid made of a camera's depth images is off
# the other way.
#
# Guess before it was run: the cloud of a scene's depth image lies on the scene's mesh, to rounding (for the grid, which was
# run after that, half a pixel was expected).
# For whom it matters: whoever simulates depth images, or fuses them into a map to register against: a sideways offset that
# grows with the distance, and a pose that is off by it. Give the rays and the grid K with 0.5 added to its middle.
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

WIDE, HIGH, STEEP = 320, 240, 0.6
Tensor, grids = o3d.core.Tensor, o3d.t.geometry
K = np.array([[200.0, 0.0, 160.0], [0.0, 200.0, 120.0], [0.0, 0.0, 1.0]])
moved = K + [[0.0, 0.0, 0.5], [0.0, 0.0, 0.5], [0.0, 0.0, 0.0]]
eye = Tensor(np.eye(4))
x = np.array([-20.0, 20.0, 20.0, -20.0])
wall = np.column_stack([x, [-20.0, -20.0, 20.0, 20.0], 3.0 + STEEP * x]).astype(np.float32)  # z = 3 + 0.6 x
scene = grids.RaycastingScene()
scene.add_triangles(Tensor(wall), Tensor(np.array([[0, 1, 2], [0, 2, 3]], np.uint32)))


def depths(intrinsic):
    """The scene's depth image; directions have z = 1, so that `t_hit` is the depth."""
    rays = grids.RaycastingScene.create_rays_pinhole(Tensor(intrinsic), eye, WIDE, HIGH)
    return rays.numpy()[..., 3:], scene.cast_rays(rays)["t_hit"].numpy()


def off(points):
    """Median signed distance from the wall, millimetres."""
    points = np.asarray(points, np.float64)
    return 1000.0 * float(np.median((points[:, 2] - 3.0 - STEEP * points[:, 0]) / np.hypot(1.0, STEEP)))


def clouds(depth):
    """What three functions make of a depth image."""
    image = grids.Image(Tensor(depth))
    new = grids.PointCloud.create_from_depth_image(image, Tensor(K), depth_scale=1.0, depth_max=20.0)
    old = o3d.geometry.PointCloud.create_from_depth_image(
        o3d.geometry.Image(depth),
        o3d.camera.PinholeCameraIntrinsic(WIDE, HIGH, 200.0, 200.0, 160.0, 120.0),
        depth_scale=1.0,
        depth_trunc=20.0,
    )
    grid = grids.VoxelBlockGrid(("tsdf", "weight"), (o3d.core.float32, o3d.core.float32), ((1), (1)), 0.02, 16, 8000)
    blocks = grid.compute_unique_block_coordinates(image, Tensor(K), eye, 1.0, 20.0)
    grid.integrate(blocks, image, Tensor(K), eye, 1.0, 20.0)
    fused = grid.extract_point_cloud(weight_threshold=0.0)
    return new.point.positions.numpy(), np.asarray(old.points), fused.point.positions.numpy()


print("open3d", version("open3d"), "numpy", np.__version__)
ways, depth = depths(K)
first = ways[0, 0, :2] * 200.0 + [160.0, 120.0]
print(f"  the ray of the first pixel goes through {first} of the image")
new, old, fused = map(off, clouds(depth))
print(f"  the scene's image: clouds {new:.1f} and {old:.1f} mm off the wall, grid {fused:.1f} mm")
aside = np.abs(clouds(depth)[1] - (ways * depth[..., None]).reshape(-1, 3)).max()
print(f"  a point of the older cloud lies up to {1000.0 * aside:.0f} mm aside of where its ray met the wall, at {depth.max():.1f} m")
assert np.allclose(first, 0.5, atol=1e-4), "open3d no longer does this"
assert 3.0 < new < 6.0 and abs(new - old) < 0.01 and abs(fused) < 1.0, "open3d no longer does this"
assert abs(1000.0 * aside - 500.0 * depth.max() / 200.0) < 0.5
ways, depth = depths(moved)
new, old, fused = map(off, clouds(depth))
print(f"  an image of pixels at whole numbers: clouds {new:.1f} and {old:.1f} mm off the wall, grid {fused:.1f} mm")
assert abs(new) < 0.01 and abs(old) < 0.01 and -7.0 < fused < -3.0, "open3d no longer does this"
print("half a pixel lies between them")
PYTHON
