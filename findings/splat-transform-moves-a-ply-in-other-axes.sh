#!/usr/bin/env bash
# splat-transform 3.7.0 (@playcanvas/splat-transform) moves and turns a PLY file not in the file's axes, but in those of its engine, which stand half a turn
# about z away: `-t 1,2,3` adds (-1, -2, 3) to the points, `-r 90,0,0` turns them by -90 degrees about x. Heights, headings and scales
# come out as told. Its words are "Translate Gaussians by (x, y, z)", and a PLY that is written again unmoved is the same.
#
# Guess before it was run: -r turns about the axes x, y and z of the file, and the frame of the file stays; -t adds its numbers to the coordinates.
# For whom it matters: whoever lays a scene of Gaussian splats on a LiDAR map by the pose of a registration: the scene lands twice its horizontal
# offset away from its place, tilted the other way. Give it x and y of the translation, and the first two of the angles, with their signs changed.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "plyfile==1.1.4" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" npm install --silent --no-fund --no-audit --ignore-scripts --prefix "$folder" "@playcanvas/splat-transform@3.7.0" >/dev/null
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import subprocess
from importlib.metadata import version

import numpy as np
from plyfile import PlyData, PlyElement
from scipy.spatial.transform import Rotation

TOOL = "node_modules/.bin/splat-transform"
NAMES = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()
rng = np.random.default_rng(0)
places = rng.uniform(-20.0, 20.0, (100, 3)).astype(np.float32)
splats = np.zeros(len(places), [(name, "f4") for name in NAMES])
splats["x"], splats["y"], splats["z"] = places.T
splats["rot_0"] = 1.0
for name in ("scale_0", "scale_1", "scale_2"):
    splats[name] = -3.0
PlyData([PlyElement.describe(splats, "vertex")]).write("in.ply")


def made(*actions):
    """The positions that it writes after the actions."""
    subprocess.run([TOOL, "--quiet", "--overwrite", "in.ply", *actions, "out.ply"], check=True)
    vertex = PlyData.read("out.ply")["vertex"]
    return np.column_stack([vertex["x"], vertex["y"], vertex["z"]])


told = subprocess.run([TOOL, "--version"], capture_output=True, text=True, check=True)
print((told.stdout + told.stderr).strip(), "plyfile", version("plyfile"), "numpy", np.__version__)
assert np.allclose(made(), places)
step = np.mean(made("-t", "1,2,3") - places, axis=0)
print(f"  -t 1,2,3 moves the points by {step.round(3).tolist()}")
assert np.allclose(step, [-1.0, -2.0, 3.0], atol=1e-4), "it now moves by what it is told"
for axis, angles, sign in (("x", "90,0,0", -1.0), ("y", "0,90,0", -1.0), ("z", "0,0,90", 1.0)):
    turned = made("-r", angles)
    assert np.allclose(turned, Rotation.from_euler(axis, 90.0 * sign, degrees=True).apply(places), atol=1e-4), "it now turns otherwise"
    print(f"  -r {angles} turns them by {90.0 * sign:.0f} degrees about {axis}")
pose, shift = Rotation.from_euler("xyz", [2.0, -3.0, 70.0], degrees=True), [5.0, -8.0, 1.0]
wanted = pose.apply(places) + shift
plain = np.linalg.norm(made("--rotate=2,-3,70", "--translate=5,-8,1") - wanted, axis=1).mean()
other = np.linalg.norm(made("--rotate=-2,3,70", "--translate=-5,8,1") - wanted, axis=1).mean()
print(f"  by a pose 9.5 m away: {plain:.2f} m off as given, {other:.5f} m with the signs changed")
assert plain > 15.0 and other < 1e-3
print("a PLY moves in other axes")
PYTHON
