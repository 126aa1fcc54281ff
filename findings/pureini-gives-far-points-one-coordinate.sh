#!/usr/bin/env bash
# pureini 0.10.0 (CloudINI's compression of PointCloud2) stores a coordinate of single precision as a whole number of
# resolutions in 32 bits. What does not fit is cut off at the largest that does: at 1 mm every northing of a map becomes
# 2,147,483.8 m, at 0.1 mm every easting beyond 214.7 km becomes 214,748.4 m. Nothing is said, and the cloud that comes back has
# as many points as before. Coordinates of double precision are right.
#
# Guess before it was run: in map coordinates too each number is off by half a resolution at the most, beside the rounding to
# single precision, or it is refused.
# For whom it matters: whoever takes clouds in map coordinates out of compressed recordings: the cloud is flat, or a line, and
# a finer resolution makes it worse. Subtract a local origin first, or give the fields as FLOAT64.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "pureini==0.10.0" "numpy<2.4"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import pureini

middle = np.array([500_000.0, 5_400_000.0, 100.0])
points = middle + np.random.default_rng(0).uniform(0.0, 50.0, (1000, 3))
KINDS = {"f4": pureini.FieldType.FLOAT32, "f8": pureini.FieldType.FLOAT64}


def returned(given, resolution):
    """The points after they were packed and unpacked."""
    size = given.itemsize
    fields = [pureini.PointField(name, k * size, KINDS[f"f{size}"], resolution) for k, name in enumerate("xyz")]
    info = pureini.EncodingInfo(fields, width=len(given), height=1, point_step=3 * size)
    packed = pureini.PointcloudEncoder(info).encode(given.tobytes())
    back, _ = pureini.PointcloudDecoder().decode(packed)
    return np.frombuffer(back, given.dtype).reshape(-1, 3)


print("pureini", version("pureini"), "numpy", np.__version__)
off, kinds = {}, {}
for kind in ("f4", "f8"):
    given = points.astype(kind)
    for resolution in (0.001, 0.0001):
        back = returned(given, resolution).astype(np.float64)
        off[kind, resolution] = np.abs(back - given).max(axis=0)
        kinds[kind, resolution] = [len(np.unique(column)) for column in back.T]
        bits = 8 * given.itemsize
        print(f"  {bits} bits, {1000 * resolution} mm: off by {off[kind, resolution].round(4)}, different x, y, z: {kinds[kind, resolution]}")
near = np.abs(returned((points - middle).astype("f4"), 0.001) - (points - middle)).max()
print(f"  32 bits, 1 mm, about a local origin: off by {near:.4f}")
assert near < 0.001 and max(off["f8", 0.001].max(), off["f8", 0.0001].max()) < 0.001
assert off["f4", 0.001][1] > 3e6 and kinds["f4", 0.001][1] == 1, "pureini no longer cuts them off"
assert off["f4", 0.0001][0] > 2e5 and kinds["f4", 0.0001][0] == 1, "pureini no longer cuts them off"
assert off["f4", 0.001][0] < 0.1, "it is the northings alone that do not fit at 1 mm"
print("far points have one coordinate")
PYTHON
