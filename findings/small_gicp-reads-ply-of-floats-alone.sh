#!/usr/bin/env bash
# small_gicp 1.0.1's `read_ply` reads one kind of PLY, little-endian floats and nothing else, and raises for no other. Of a
# big-endian file it makes points at 1e-22, 1e+31 and NaN; of one with doubles, or with a colour or an intensity of one byte beside
# x, y and z, as most scanners' files have, a cloud of no points. A line on the standard error tells the latter, nothing the former.
#
# Guess before it was run: a PLY that is valid is read, or refused by an exception.
# For whom it matters: whoever reads scans by it for `align` in a loop or a service: an empty or a scattered cloud goes on into
# what follows, and what fails is the registration, if anything does.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "small_gicp==1.0.1" "numpy<2.5"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import numpy as np
import small_gicp

points = np.random.default_rng(0).uniform(-5.0, 5.0, (50, 3))
KINDS = {
    "little-endian floats": ("little", "<f4", "float", None),
    "big-endian floats": ("big", ">f4", "float", None),
    "little-endian doubles": ("little", "<f8", "double", None),
    "floats with a byte of intensity": ("little", "<f4", "float", "uchar"),
}


def read(order, kind, name, intensity):
    header = ["ply", f"format binary_{order}_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property {name} {axis}" for axis in "xyz"]
    header += [f"property {intensity} intensity"] if intensity else []
    rows = np.zeros(len(points), [(axis, kind) for axis in "xyz"] + ([("intensity", "u1")] if intensity else []))
    for k, axis in enumerate("xyz"):
        rows[axis] = points[:, k]
    Path("cloud.ply").write_bytes(("\n".join([*header, "end_header"]) + "\n").encode() + rows.tobytes())
    return np.asarray(small_gicp.read_ply("cloud.ply").points())[:, :3]


print("small_gicp", version("small_gicp"), "numpy", np.__version__)
clouds = {}
for what, layout in KINDS.items():
    clouds[what] = read(*layout)
    right = sum(np.isclose(clouds[what], points[: len(clouds[what])], atol=1e-5).all(axis=1))
    print(f"  {what}: {len(clouds[what])} of {len(points)} points, {right} of them right")
floats, big, doubles, intensity = clouds.values()
assert np.allclose(floats, points, atol=1e-5), "small_gicp no longer reads little-endian floats"
assert len(big) == 50 and not np.isclose(big, points, atol=1.0).all(axis=1).any(), "small_gicp no longer takes any order of bytes for its own"
assert len(doubles) == len(intensity) == 0, "small_gicp now reads or refuses doubles and bytes"
print("reads ply of floats alone")
PYTHON
