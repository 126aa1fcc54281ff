#!/usr/bin/env bash
# laspy 2.7.0 stores coordinates as whole numbers, and refuses those that do not fit (`OverflowError`). Missing returns, NaN, pass
# that check: they become whatever whole number the processor makes of them, the lowest there is or zero, and are
# points again when the file is read, here 2147 km from the origin of the grid. Only numpy warns, of an invalid value in a
# cast. The header's bounds span the whole way, so that viewers and tiling see a file of that extent. NaN in an extra
# dimension with a scale becomes a number in the same way.
#
# Guess before it was run: NaN raises, as what does not fit does.
# For whom it matters: whoever saves organised clouds of sensors as LAS. Leave the missing returns out before `xyz` is set:
# `points[np.isfinite(points).all(axis=1)]`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "laspy==2.7.0" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import warnings
from importlib.metadata import version

import laspy
import numpy as np


def written(points, heights):
    header = laspy.LasHeader(point_format=6, version="1.4")
    header.scales, header.offsets = np.full(3, 0.001), np.zeros(3)
    header.add_extra_dim(laspy.ExtraBytesParams("above", "int16", scales=np.array([0.01]), offsets=np.array([50.0])))
    cloud = laspy.LasData(header)
    cloud.xyz = points
    cloud.above = heights
    cloud.write("cloud.las")
    return laspy.read("cloud.las")


points = np.random.default_rng(0).uniform(-20.0, 20.0, (1000, 3))
missing = np.arange(1000) % 10 == 0
heights = np.full(1000, 51.23)
print("laspy", version("laspy"), "numpy", np.__version__)
try:
    written(points * 1e6, heights)
    refused = False
except OverflowError as error:
    refused = True
    print(f"  coordinates of 20,000 km: {error}")
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    cloud = written(np.where(missing[:, None], np.nan, points), np.where(missing, np.nan, heights))
found = np.asarray(cloud.xyz)
print(f"  {missing.sum()} of 1000 points NaN: {np.isfinite(found).all(axis=1).sum()} finite points are read")
print(f"  the missing ones are at {np.unique(found[missing], axis=0).tolist()}, with {np.unique(np.asarray(cloud.above)[missing])}")
print(f"  bounds of the header: {cloud.header.mins.tolist()} to {cloud.header.maxs.tolist()}")
print(f"  warnings: {sorted({str(each.message) for each in told})}")
assert refused and np.abs(found[~missing] - points[~missing]).max() < 0.001
assert np.isfinite(found).all() and np.isfinite(np.asarray(cloud.above)).all(), "laspy no longer does this"
assert len(np.unique(found[missing], axis=0)) == 1
print("missing returns become points of one place")
PYTHON
