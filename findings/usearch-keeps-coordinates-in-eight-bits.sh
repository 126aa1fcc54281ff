#!/usr/bin/env bash
# usearch 2.26.6's `Index(ndim=3, metric="l2sq")` keeps points in bfloat16, eight bits of each number, or in half precision, eleven, where
# the processor has instructions for either, and in single precision elsewhere; its description says that hardware decides.
# Numbers of single precision go in, and are rounded without a word. 400 m from the origin a scan's neighbours in a map come out up to
# two metres off, at distances that are half of the true ones, and 455 km off, where tiles lie, none is right. Another machine
# finds others. With `dtype="f32"` all are right at 400 m.
#
# Guess before it was run: single precision, as that is what is handed over.
# For whom it matters: whoever takes it for the nearest neighbours of points, being quick: what looks like a good fit is a
# rounded one. Give `dtype`, "f64" in a map, and read `index.dtype`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "usearch==2.26.6" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from scipy.spatial import cKDTree
from usearch.index import Index

rng = np.random.default_rng(0)
map_ = rng.uniform(-20.0, 20.0, (20_000, 3))
scan = map_[:200] + rng.normal(0.0, 0.05, (200, 3))
print("usearch", version("usearch"), "scipy", version("scipy"), "numpy", np.__version__)
found = {}
for place, middle in (("at the origin", (0, 0, 0)), ("400 m off", (400, 300, 20)), ("in a map's grid", (455_000, 5_427_000, 200))):
    true, _ = cKDTree(map_ + middle).query(scan + middle)
    for dtype in (None, "bf16", "f16", "f32"):
        index = Index(ndim=3, metric="l2sq", dtype=dtype)
        index.add(np.arange(len(map_)), (map_ + middle).astype(np.float32))
        got = index.search((scan + middle).astype(np.float32), 1)
        real = np.linalg.norm(map_[got.keys[:, 0].astype(int)] - scan, axis=1)
        told = np.sqrt(got.distances[:, 0])
        found[place, dtype] = np.mean(real - true)
        name = f"chosen ({index.dtype})" if dtype is None else dtype
        print(
            f"  {place}, {name}: neighbours lie {real.mean():.2f} m away, at most {real.max():.2f}; told {told.mean():.2f};"
            f" of a tree {true.mean():.2f}"
        )
assert found["400 m off", "f32"] < 0.001 and found["400 m off", "bf16"] > 0.1
assert found["in a map's grid", "bf16"] > 5.0 and found["in a map's grid", "f16"] > 5.0
chosen = str(Index(ndim=3, metric="l2sq").dtype)
assert not chosen.endswith("F32"), "usearch now chooses single precision, or this processor has nothing shorter"
print("what is near depends on eight bits")
PYTHON
