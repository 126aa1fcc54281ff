#!/usr/bin/env bash
# livox-lvx 0.2.1 reads the points of Livox' `.lvx` recordings, whose Cartesian coordinates are signed millimetres, as unsigned
# numbers: what lies to the right of the sensor or below it comes out 4294.967 km away, on the other side. Depths, angles and
# reflectivities are right. To write a point with a negative coordinate, read from elsewhere, it raises `struct.error`.
#
# Guess before it was run: coordinates with their sign, in metres.
# For whom it matters: whoever reads the older recordings without Livox Viewer: seven in eight points lie in no place, and filters by
# range leave one octant, which registers to nothing or to a wrong place. Take each coordinate as
# `x - 2**32 if x >= 2**31 else x`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "livox-lvx==0.2.1" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import struct
from importlib.metadata import version

import numpy as np
from lvx import LvxFileReader

truth = np.random.default_rng(0).uniform(-20.0, 20.0, (96, 3)).round(3)


def recording():
    """One frame of one package of 96 points, as the description of LVX 1.1 lays them out: data type 2."""
    public = b"livox_tech".ljust(16, b"\0") + bytes([1, 1, 0, 0]) + struct.pack("<I", 0xAC0EA767)
    private = struct.pack("<IB", 50, 1)
    device = bytes(32) + struct.pack("<BBB6f", 0, 1, 0, *[0.0] * 6)
    points = b"".join(
        struct.pack("<3i2B", *(round(1000.0 * value) for value in point), 77, 0) for point in truth.tolist()
    )
    package = struct.pack("<5BIBBQ", 0, 5, 1, 1, 0, 0, 0, 2, 0) + points
    start = len(public) + len(private) + len(device)
    frame = struct.pack("<3Q", start, start + 24 + len(package), 0) + package
    return public + private + device + frame


with open("drive.lvx", "wb") as file:
    file.write(recording())
with open("drive.lvx", "rb") as file:
    (frame,) = LvxFileReader(file)
held = frame.packages[0].points
found = np.array([(point.x, point.y, point.z) for point in held]) / 1000.0
print("livox-lvx", version("livox-lvx"), "numpy", np.__version__)
negative = truth < 0.0
print(f"  {len(found)} points of {np.ptp(truth, axis=0).round(1).tolist()} m: found up to {found.max():.3f} m away")
for axis, name in enumerate("xyz"):
    off = found[:, axis] - truth[:, axis]
    print(f"  {name}: {negative[:, axis].sum()} negative, off by {np.unique(off.round(3)).tolist()} m")
whole = np.all(np.abs(found - truth) < 1e-6, axis=1)
signed = np.where(found >= 2**31 / 1000.0, found - 2**32 / 1000.0, found)
print(f"  points where they are: {whole.sum()}; with the sign given back: {np.abs(signed - truth).max():.4f} m off at most")
assert {point.reflectivity for point in held} == {77}
assert np.allclose(signed, truth, atol=1e-6) and np.allclose(found[~negative], truth[~negative], atol=1e-6)
assert np.allclose(found[negative] - truth[negative], 2**32 / 1000.0), "livox-lvx no longer does this"
print("millimetres are read without their sign")
PYTHON
