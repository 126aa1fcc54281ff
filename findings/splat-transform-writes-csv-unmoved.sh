#!/usr/bin/env bash
# splat-transform 3.7.0 (@playcanvas/splat-transform) leaves `--translate`, `--rotate` and `--scale` out of the CSV files that it writes: their positions are
# those of the input, without a word. The filters among the same actions see the moved scene: those that lie above a height
# after the move are kept, and are written where they lay before.
#
# Guess before it was run: a CSV file holds the same positions as a PLY file written by the same actions.
# For whom it matters: whoever takes the middles of Gaussian splats out as CSV, the tool's one text format, to register them as a cloud:
# a scene that was scaled to metres is still in its own unit. Write a PLY first, and the CSV from it in a second run.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "plyfile==1.1.4" "numpy<2.5"
cd "$folder"
HOME="$folder" npm install --silent --no-fund --no-audit --ignore-scripts --prefix "$folder" "@playcanvas/splat-transform@3.7.0" >/dev/null
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
import subprocess
from importlib.metadata import version

import numpy as np
from plyfile import PlyData, PlyElement

TOOL = "node_modules/.bin/splat-transform"
NAMES = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3".split()
rng = np.random.default_rng(0)
places = rng.uniform(0.0, 20.0, (200, 3)).astype(np.float32)
splats = np.zeros(len(places), [(name, "f4") for name in NAMES])
splats["x"], splats["y"], splats["z"] = places.T
splats["rot_0"] = 1.0
for name in ("scale_0", "scale_1", "scale_2"):
    splats[name] = -3.0
PlyData([PlyElement.describe(splats, "vertex")]).write("in.ply")


def made(name, *actions, source="in.ply"):
    """The positions that it writes after the actions."""
    subprocess.run([TOOL, "--quiet", "--overwrite", source, *actions, name], check=True)
    if name.endswith(".csv"):
        table = np.genfromtxt(name, delimiter=",", names=True)
    else:
        table = PlyData.read(name)["vertex"]
    return np.column_stack([table["x"], table["y"], table["z"]])


told = subprocess.run([TOOL, "--version"], capture_output=True, text=True, check=True)
print((told.stdout + told.stderr).strip(), "plyfile", version("plyfile"), "numpy", np.__version__)
for action in (["--scale", "2"], ["--rotate", "0,0,90"], ["--translate", "0,0,5"]):
    moved = [np.abs(made(name, *action) - places).mean() for name in ("out.ply", "out.csv")]
    print(f"  {' '.join(action)}: coordinates of the PLY change by {moved[0]:.1f} on average, of the CSV by {moved[1]:.1f}")
    assert moved[0] > 1.0 and moved[1] < 1e-3, "its CSV files are moved now"
lifted = ("--translate", "0,0,100", "--filter-value", "z,gt,110")
ply, table = (made(name, *lifted) for name in ("out.ply", "out.csv"))
print(f"  lifted by 100, those above 110: {len(ply)} at {ply[:, 2].min():.0f} or more in the PLY, {len(table)} at {table[:, 2].min():.0f} or more in the CSV")
assert len(ply) == len(table) < len(places) and ply[:, 2].min() > 110.0 and table[:, 2].max() < 20.5
made("moved.ply", "--scale", "2")
assert np.allclose(made("out.csv", source="moved.ply"), 2.0 * places, atol=1e-3)
print("CSV is written as if nothing had moved")
PYTHON
