#!/usr/bin/env bash
# The format SPZ of Gaussian splats keeps a coordinate in 24 bits, 12 of them behind the point as its writers have it: it ends
# at 2048 m. gaussforge 0.6.0 folds what lies beyond back into that range, so that a map in UTM comes out within two kilometres
# of the origin, each axis folded by itself; gsply 0.4.6's `write_spz` puts it all on the edge. Neither says a word, nor does
# either raise. Within the range a coordinate comes back to an eighth of a millimetre.
#
# Guess before it was run: places to a 4096th of a metre, and an error for those too far away.
# For whom it matters: whoever packs georeferenced splats or a point cloud as splats for a viewer and takes points out again.
# Subtract a local origin first, and keep it beside the file: SPZ has no place for it.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "gaussforge==0.6.0" "gsply==0.4.6" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON' | grep -v '^\[SPZ\]'
from importlib.metadata import version
from pathlib import Path

import gaussforge
import gsply
import numpy as np

rng = np.random.default_rng(0)
forge = gaussforge.GaussForge()
N = 500


def splats(offset):
    turns = np.tile(np.float32([1.0, 0.0, 0.0, 0.0]), (N, 1))
    places = (rng.uniform(-50.0, 50.0, (N, 3)) + offset).astype(np.float32)
    grey = np.zeros((N, 3), np.float32)
    gsply.plywrite("in.ply", places, np.full((N, 3), -4.0, np.float32), turns, np.ones(N, np.float32), grey)
    return places


def by_gaussforge():
    packed = forge.convert(Path("in.ply").read_bytes(), "ply", "spz")
    assert "error" not in packed, packed
    back = forge.convert(packed["data"], "spz", "ply")
    assert "error" not in back, back
    Path("out.ply").write_bytes(back["data"])
    return gsply.plyread("out.ply").means


def by_gsply():
    gsply.write_spz("out.spz", gsply.plyread("in.ply"))
    return gsply.read_spz("out.spz").means


print("gaussforge", version("gaussforge"), "gsply", version("gsply"), "numpy", np.__version__)
for words, offset in (("a scene", [0.0, 0.0, 0.0]), ("2030 m away", [2030.0, 0.0, 0.0]), ("in UTM", [5e5, 5.4e6, 100.0])):
    places = splats(offset)
    for name, found in (("gaussforge", by_gaussforge()), ("gsply", by_gsply())):
        error = np.abs(found.astype(float) - places).max(axis=0)
        span = [each.astype(float).round(1).tolist() for each in (found.min(axis=0), found.max(axis=0))]
        print(f"  {words}, {name}: up to {error.round(4).tolist()} m off, from {span[0]} to {span[1]}")
        if words == "a scene":
            assert error.max() < 2e-4
        elif words == "2030 m away":
            far = places[:, 0] > 2049.0
            edge = -2048.0 if name == "gaussforge" else 2047.0
            folded = found[far, 0] < edge + 100.0 if name == "gaussforge" else found[far, 0] > edge
            assert far.any() and folded.all(), f"{name} no longer does this"
            assert np.abs(found[~far] - places[~far])[places[~far][:, 0] < 2047.0].max() < 2e-4
        else:
            assert np.abs(found).max() <= 2048.0, f"{name} no longer does this"
print("beyond 2048 m a coordinate is another one")
PYTHON
