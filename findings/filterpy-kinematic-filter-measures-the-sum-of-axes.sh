#!/usr/bin/env bash
# filterpy 2.0.0's `kinematic_kf(dim=3, order=1)` documents a measurement of the position, one number a dimension, and makes a
# measurement matrix of one row: x + y + z. Three numbers are refused, a single one, as of one axis, is taken, and pulls all axes.
#
# Guess before it was run: H picks the three positions, so that each is measured.
# For whom it matters: whoever smooths the translations of registered scans with it: set `filter.dim_z = 3` and H by hand.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "filterpy==2.0.0" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from filterpy.common import kinematic_kf

print("filterpy", version("filterpy"))
for by_dim in (True, False):
    made = kinematic_kf(dim=3, order=1, dt=0.1, order_by_dim=by_dim)
    print(f"order_by_dim={by_dim}: the state has {len(made.x)} numbers, H is {made.H.tolist()}")
    assert made.H.shape == (1, 6), "each axis has a row now"
    assert made.H.sum() == 3.0
    refused = False
    try:
        made.update(np.array([[1.0], [2.0], [3.0]]))
    except ValueError as error:
        refused = True
        print("  a position of three numbers:", str(error).splitlines()[0][:100])
    made = kinematic_kf(dim=3, order=1, dt=0.1, order_by_dim=by_dim)
    made.update(6.0)
    places = np.asarray(made.x).ravel()[[0, 2, 4] if by_dim else [0, 1, 2]]
    print("  after update(6.0) all positions are", places.round(2))
    assert refused
    assert np.allclose(places, places[0]) and places[0] > 0.0
PYTHON
