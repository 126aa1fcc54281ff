#!/usr/bin/env bash
# fpsample 1.0.2's two samplers by buckets, those that its description recommends, do not start at the row that
# `start_idx` names: what they return is the farthest point sampling from another row, and seldom holds the one that was
# asked for. A list of rows, which the description of `start_idx` takes as well, raises TypeError. The plain sampler and
# those with NPDU start where they are told.
#
# Guess before it was run: the first index that is returned is `start_idx`, and the exact samplers agree from there on.
# For whom it matters: whoever fixes the first point (the one nearest the sensor, a keypoint, row 0 to compare with
# another library), or reads the first index as known. Where any fixed start will do, the result is deterministic. (Where
# the registry has no wheel of it, pip builds it, with a C++ compiler.)
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "fpsample==1.0.2" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import fpsample
import numpy as np

COUNT = 200
points = np.random.default_rng(0).uniform(0.0, 10.0, (5000, 3))


def farthest(start):
    """Rows by the method's definition: always the point farthest from all before."""
    rows, distance = [start], np.linalg.norm(points - points[start], axis=1)
    while len(rows) < COUNT:
        rows.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[rows[-1]], axis=1))
    return rows


ways = {
    "fps_sampling": fpsample.fps_sampling,
    "fps_npdu_sampling": fpsample.fps_npdu_sampling,
    "fps_npdu_kdtree_sampling": fpsample.fps_npdu_kdtree_sampling,
    "bucket_fps_kdtree_sampling": fpsample.bucket_fps_kdtree_sampling,
    "bucket_fps_kdline_sampling": lambda *cloud, **start: fpsample.bucket_fps_kdline_sampling(*cloud, h=3, **start),
}
print("fpsample", version("fpsample"), "numpy", version("numpy"))
for name, way in ways.items():
    told = []
    for start in (0, 7, 4999):
        rows = [int(row) for row in way(points, COUNT, start_idx=start)]
        told.append(f"{start} -> {rows[0]}")
        if name.startswith("bucket"):
            assert rows[0] != start and start not in rows, f"{name} starts where it is told now"
            assert rows == farthest(rows[0]), f"{name} no longer gives the method's points from where it starts"
        else:
            assert rows[0] == start, f"{name} starts elsewhere now"
    print(f"  {name}: start_idx and the first index,", ", ".join(told))
for name in ("bucket_fps_kdtree_sampling", "bucket_fps_kdline_sampling"):
    try:
        ways[name](points, COUNT, start_idx=[3, 1000])
    except TypeError as error:
        print(f"  {name}: a list of starts raises", error)
    else:
        raise AssertionError(f"{name} takes a list now")
print("the samplers by buckets start at another point than the one asked for")
PYTHON
