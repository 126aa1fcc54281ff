#!/usr/bin/env bash
# pynndescent 0.7.0's `NNDescent` takes a cloud of doubles and queries of doubles, and looks for neighbours in single precision, without
# a word. In a map's grid (northings of millions of metres) numbers of that kind are half a metre apart: of a scan of a surface with a
# point every few centimetres half of the neighbours are other points, eight times as far away on average, and the distances are others
# again. At the origin all are right.
#
# Guess before it was run: doubles are kept, and more than 95 of 100 neighbours are right at either place.
# For whom it matters: whoever matches scans to a map, or counts residuals against one: those of a right pose look like those of a wrong
# one. Subtract one offset from both clouds first.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pynndescent==0.7.0" "numba==0.68.1" "scipy<1.18" "numpy<2.5"
cd "$folder"
HOME="$folder" OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 "$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from pynndescent import NNDescent
from scipy.spatial import cKDTree

rng = np.random.default_rng(0)
map_ = rng.uniform(0.0, [6.0, 6.0, 0.3], (20_000, 3))
scan = map_[:300] + rng.normal(0.0, 0.01, (300, 3))
print("pynndescent", version("pynndescent"), "scipy", version("scipy"), "numpy", np.__version__)
found = {}
for place, middle in (("at the origin", np.zeros(3)), ("in a map's grid", np.array([455_000.0, 5_427_000.0, 200.0]))):
    true, nearest = cKDTree(map_ + middle).query(scan + middle)
    rows, told = NNDescent(map_ + middle, metric="euclidean", random_state=0, n_jobs=1).query(scan + middle, k=1)
    real = np.linalg.norm(map_[rows[:, 0]] - scan, axis=1)
    found[place] = (np.mean(rows[:, 0] == nearest), real.mean() / true.mean())
    print(
        f"  {place}: right neighbours {found[place][0]:.0%}; {real.mean():.3f} m away, a tree's {true.mean():.3f} m;"
        f" told {told.mean():.3f} m"
    )
assert found["at the origin"][0] > 0.95
assert found["in a map's grid"][0] < 0.8 and found["in a map's grid"][1] > 3.0, "pynndescent now keeps doubles"
print("near is what single precision says")
PYTHON
