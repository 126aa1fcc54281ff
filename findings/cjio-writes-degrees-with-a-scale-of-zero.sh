#!/usr/bin/env bash
# cjio 0.10.1 writes the `transform` of a CityJSON file with six decimals. `crs_reproject` to longitudes and latitudes keeps
# eight digits, so that the scale is 0.00000001 and is written as 0.000000: every vertex of the file that it saves is the
# same place, and the whole numbers in it cannot be undone without knowing what the scale was. It says that it saved the
# file. With `--digit` the same happens from seven digits on, the number in its own help; six are 11 cm.
#
# Guess before it was run: the model in degrees, as `crs_reproject --help` shows it (noted after a first output).
# For whom it matters: whoever brings a city model to another system before a scan is registered to it. Reproject from one
# system in metres to another, which stays exact, or multiply the vertices out first and reproject them with pyproj.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "cjio==0.10.1" "pyproj==3.7.2" "numpy<2.5"
cd "$folder"
cat > box.py <<'PYTHON'
"""A building of 10 m x 10 m x 10 m, its corners in millimetres from a place in UTM's zone 32."""

import json

CORNERS = [[x, y, z] for z in (0, 10_000) for x, y in ((0, 0), (10_000, 0), (10_000, 10_000), (0, 10_000))]
FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
solid = {"type": "Solid", "lod": "2", "boundaries": [[[face] for face in FACES]]}
json.dump(
    {
        "type": "CityJSON",
        "version": "2.0",
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/25832"},
        "transform": {"scale": [0.001] * 3, "translate": [500_000.0, 5_400_000.0, 100.0]},
        "CityObjects": {"box": {"type": "Building", "geometry": [solid]}},
        "vertices": CORNERS,
    },
    open("box.city.json", "w"),
)
PYTHON
"$folder/env/bin/python" box.py
"$folder/env/bin/cjio" --suppress_msg box.city.json crs_reproject 25833 save metres.city.json > /dev/null
"$folder/env/bin/cjio" --suppress_msg box.city.json crs_reproject 4326 save degrees.city.json > /dev/null
"$folder/env/bin/cjio" --suppress_msg box.city.json crs_reproject --digit 7 4979 save seven.city.json > /dev/null
"$folder/env/bin/python" - <<'PYTHON'
import json
from importlib.metadata import version

import numpy as np
from pyproj import Transformer


def read(path):
    """The vertices, (n, 3), and the scale, as CityJSON says: whole numbers times the scale, plus the translation."""
    held = json.load(open(path))
    scale, move = np.array(held["transform"]["scale"]), np.array(held["transform"]["translate"])
    return np.array(held["vertices"]) * scale + move, scale


print("cjio", version("cjio"), "pyproj", version("pyproj"), "numpy", np.__version__)
box, _ = read("box.city.json")
metres, _ = read("metres.city.json")
wanted = np.column_stack(Transformer.from_crs(25832, 25833).transform(*box.T))
off = np.abs(np.sort(metres, axis=0) - np.sort(wanted, axis=0)).max()
print(f"  to UTM's zone 33: up to {off:.4f} m off")
found = {}
for name in ("degrees", "seven"):
    vertices, scale = read(f"{name}.city.json")
    found[name] = len(np.unique(vertices, axis=0)), float(scale.max())
    print(f"  {name}: {len(vertices)} corners at {found[name][0]} place, {vertices[0]}, scale {scale.tolist()}")
assert off < 0.002
assert len(np.unique(box, axis=0)) == 8
assert all(each == (1, 0.0) for each in found.values()), "cjio no longer does this"
print("a city model in degrees becomes one point")
PYTHON
