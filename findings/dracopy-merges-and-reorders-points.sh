#!/usr/bin/env bash
# DracoPy 2.2.0 encodes a cloud of points without faces in another order and with equal points merged, unless it is given
# `preserve_order=True`: of 1000 points that lie at ten places ten come back. The step of its quantization is a 16,384th of
# the extent by default, so that one stray return far away coarsens all points.
#
# Guess before it was run: as many points as went in, in their order, each off by no more than a step.
# For whom it matters: whoever keeps times, rings, labels or viewpoints beside the points: row k is another point then, and
# nothing tells so as long as no point lies twice. Organised clouds lose their missing returns, which all lie at the origin.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "DracoPy==2.2.0" "numpy<2.5"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import DracoPy
import numpy as np


def back(points, **how):
    """The points (N, 3) after they were encoded and decoded."""
    return np.asarray(DracoPy.decode(DracoPy.encode(points, **how)).points)


def apart(points, others):
    """The largest distance from a point to the nearest of others, metres."""
    return max(np.linalg.norm(others - point, axis=1).min() for point in points)


rng = np.random.default_rng(0)
scan = rng.uniform(-10.0, 10.0, (1000, 3)).astype(np.float32)
holed = scan.copy()
holed[::4] = 0.0  # missing returns
stray = scan.copy()
stray[0] = [5000.0, 0.0, 0.0]

plain, kept = back(scan), back(scan, preserve_order=True)
rows = int((np.linalg.norm(plain - scan, axis=1) < 0.01).sum())
print("DracoPy", version("DracoPy"), "numpy", np.__version__)
print(f"  a scan of 1000 points: {len(plain)} come back, {rows} of them in their row")
print(f"  with preserve_order: {len(kept)}, off by up to {np.abs(kept - scan).max():.4f} m in their row")
print(f"  250 of them at the origin: {len(back(holed))} come back")
print(f"  as ten places, each a hundred times: {len(back(np.repeat(scan[:10], 100, axis=0)))} come back")
coarse = apart(scan[1:], back(stray))
print(f"  one at 5 km: the others are off by up to {coarse:.2f} m, and else by {apart(scan, plain):.4f} m")
assert len(plain) == len(kept) == 1000 and np.abs(kept - scan).max() < 0.01 and apart(scan, plain) < 0.01
assert rows < 20 and len(back(holed)) == 751, "DracoPy no longer does this"
assert len(back(np.repeat(scan[:10], 100, axis=0))) == 10 and coarse > 0.1, "DracoPy no longer does this"
print("rows are not the rows that went in")
PYTHON
