#!/usr/bin/env bash
# laspy 2.7.0's writer brings points of another file to its own scales and offsets before it stores them; its appender
# (`laspy.open(path, mode="a")`) does not. `append_points` takes the same points and stores their raw integers, so that
# they lie where the difference of the offsets puts them, a kilometre away here, and the header's bounds agree with that.
# Its description asks for the same point format only, which these have.
#
# Guess before it was run: both store the same coordinates, or the appender refuses points on another grid.
# For whom it matters: whoever merges tiles by appending, as each tile of a survey has offsets of its own, and registers
# to the result. Call `change_scaling(scales=..., offsets=...)` on the `LasData` beforehand, with the first file's.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "laspy[lazrs]==2.7.0" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import shutil
from importlib.metadata import version

import laspy
import numpy as np


def tile(path, points, offsets, scale):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.offsets, header.scales = offsets, np.full(3, scale)
    tile = laspy.LasData(header)
    tile.xyz = points
    tile.write(path)


def second_half(path):
    """The points behind the first tile's thousand, as they are read again."""
    return np.asarray(laspy.read(path).xyz)[1000:]


rng = np.random.default_rng(0)
west = rng.uniform(0.0, 1000.0, (1000, 3)) * [1.0, 1.0, 0.05] + [500_000.0, 5_400_000.0, 200.0]
east = west + [1000.0, 0.0, 0.0]
print("laspy", version("laspy"), "lazrs", version("lazrs"))
for kind in ("las", "laz"):
    tile(f"west.{kind}", west, [500_000.0, 5_400_000.0, 0.0], 0.001)
    tile(f"east.{kind}", east, [501_000.0, 5_400_000.0, 0.0], 0.001)
    with laspy.open(f"written.{kind}", mode="w", header=laspy.read(f"west.{kind}").header) as writer:
        writer.write_points(laspy.read(f"west.{kind}").points)
        writer.write_points(laspy.read(f"east.{kind}").points)
    shutil.copy(f"west.{kind}", f"appended.{kind}")
    with laspy.open(f"appended.{kind}", mode="a") as appender:
        appender.append_points(laspy.read(f"east.{kind}").points)
    shutil.copy(f"west.{kind}", f"cured.{kind}")
    tiles = laspy.read(f"east.{kind}")
    with laspy.open(f"cured.{kind}", mode="a") as appender:
        tiles.change_scaling(scales=appender.header.scales, offsets=appender.header.offsets)
        appender.append_points(tiles.points)
    off = {name: second_half(f"{name}.{kind}") - east for name in ("written", "appended", "cured")}
    print(f".{kind}: the second tile is off by")
    for name, error in off.items():
        print(f"  {name}: {np.round(np.median(error, axis=0), 3) + 0.0} m")
    assert abs(off["written"]).max() < 0.002 and abs(off["cured"]).max() < 0.002, "laspy's writer no longer rescales"
    assert np.allclose(off["appended"], [-1000.0, 0.0, 0.0], atol=0.002), "laspy's appender no longer does this"
print("appended points keep their integers, not their coordinates")
PYTHON
