#!/usr/bin/env bash
# viser 1.1.1 sends the points of `scene.add_point_cloud` to the browser in half precision unless it is told
# `precision="float32"`: steps of 3 cm from 32 m on and of 6 cm from 64 m on. Points of a map grid become infinite, and all
# that tells so is numpy's warning of an overflow in a cast. Its frames and cameras are in double precision.
#
# Guess before it was run: single precision, as every other viewer has it.
# For whom it matters: whoever looks at two registered clouds: walls look layered, and as if one cloud were some centimetres
# off, where the pose is right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "viser==1.1.1" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
import socket
import warnings
from importlib.metadata import version

import numpy as np
import viser

with socket.socket() as free:
    free.bind(("127.0.0.1", 0))
    port = free.getsockname()[1]
server = viser.ViserServer(host="127.0.0.1", port=port, verbose=False)
scan = np.random.default_rng(0).uniform(-100.0, 100.0, (1000, 3))


def sent(points, **how):
    """The points that go to the browser, and the warnings."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        handle = server.scene.add_point_cloud("/cloud", points, (255, 255, 255), **how)
    return np.asarray(handle.points, np.float64), [str(each.message) for each in told]


half, quiet = sent(scan)
single, _ = sent(scan, precision="float32")
grid, told = sent(scan + [500_000.0, 5_400_000.0, 100.0])
server.stop()
print("viser", version("viser"), "numpy", np.__version__)
print(f"  a scan up to 100 m wide: off by up to {np.abs(half - scan).max():.4f} m, warnings: {quiet}")
print(f"  with precision='float32': off by up to {np.abs(single - scan).max():.6f} m")
print(f"  on a map grid: {np.isfinite(grid).all(axis=1).sum()} of {len(grid)} points are finite, warnings: {told}")
assert np.abs(single - scan).max() < 1e-4
assert 0.02 < np.abs(half - scan).max() < 0.04 and not quiet, "viser no longer does this"
assert not np.isfinite(grid).all(axis=1).any(), "viser no longer does this"
print("points are shown to 3 cm, those of a map not at all")
PYTHON
