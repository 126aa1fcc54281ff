#!/usr/bin/env bash
# cjio 0.10.1 exports a CityJSON model to OBJ and GLB in the coordinates of its system, and to STL in the whole numbers in which
# the file keeps its vertices, without their scale and translation: a building of 10 m is 10,000 long at a scale of a
# millimetre and stands at the origin. Two files of neighbouring tiles, each with an origin of its own, come out on top
# of each other. Nothing tells so; STL has no unit that could. The normals of all faces are (0, 0, 0).
#
# Guess before it was run: the same full coordinates in all three.
# For whom it matters: whoever registers a scan to a city model by way of STL, which many mesh tools ask for. Export OBJ (three
# decimals), or multiply the STL's corners by `transform.scale` and add `transform.translate` of the CityJSON file.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "cjio==0.10.1" "triangle==20250106" "numpy<2.5"
cd "$folder"
cat > box.py <<'PYTHON'
"""Two buildings of 10 m x 10 m x 10 m in two tiles that lie a kilometre apart, their corners in millimetres."""

import json

CORNERS = [[x, y, z] for z in (0, 10_000) for x, y in ((0, 0), (10_000, 0), (10_000, 10_000), (0, 10_000))]
FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
solid = {"type": "Solid", "lod": "2", "boundaries": [[[face] for face in FACES]]}
for name, east in (("west", 500_000.0), ("east", 501_000.0)):
    json.dump(
        {
            "type": "CityJSON",
            "version": "2.0",
            "transform": {"scale": [0.001] * 3, "translate": [east, 5_400_000.0, 100.0]},
            "CityObjects": {name: {"type": "Building", "geometry": [solid]}},
            "vertices": CORNERS,
        },
        open(f"{name}.city.json", "w"),
    )
PYTHON
"$folder/env/bin/python" box.py
for tile in west east; do
    for kind in obj stl; do
        "$folder/env/bin/cjio" --suppress_msg "$tile.city.json" export "$kind" "$tile.$kind" > /dev/null
    done
done
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version
from pathlib import Path

import numpy as np


def corners(path, word):
    rows = [line.split() for line in Path(path).read_text().splitlines() if line.strip().startswith(f"{word} ")]
    return np.unique([[float(value) for value in row[-3:]] for row in rows], axis=0)


print("cjio", version("cjio"), "triangle", version("triangle"), "numpy", np.__version__)
held = {}
for tile, east in (("west", 500_000.0), ("east", 501_000.0)):
    held[tile] = corners(f"{tile}.obj", "v"), corners(f"{tile}.stl", "vertex")
    for kind, found in zip(("OBJ", "STL"), held[tile]):
        print(f"  {tile}.{kind.lower()}: {len(found)} corners from {found.min(axis=0)} to {found.max(axis=0)}")
    assert np.allclose(held[tile][0].min(axis=0), [east, 5_400_000.0, 100.0])
    assert np.allclose(np.ptp(held[tile][0], axis=0), 10.0)
normals = corners("west.stl", "facet")
print(f"  normals of the STL: {normals.tolist()}")
assert np.array_equal(held["west"][1], held["east"][1]), "cjio no longer does this"
assert np.array_equal(held["west"][1].max(axis=0), [10_000.0] * 3), "cjio no longer does this"
print("the STL holds the numbers of the file, not its coordinates")
PYTHON
