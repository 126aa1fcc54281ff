#!/usr/bin/env bash
# truckscenes-devkit 1.2.0's `PointCloud.subsample(ratio)` draws the points that stay with replacement: `subsample(1.0)` keeps 63 %
# of them, and every third row is a copy of another. The times of the points, which its lidar clouds have beside the points,
# stay all as they were, in their order, so that the rows of the two no longer belong together.
#
# Guess before it was run: `subsample(1.0)` keeps every point once, and the times follow (noted after the code was read).
# For whom it matters: whoever thins scans with it before a registration, a training or an undistortion: copies count twice in
# every mean and have the distance 0 to a neighbour, and times belong to other points. Choose rows by `numpy.random.Generator.choice`
# with `replace=False`, and take `points[:, rows]` and `timestamps[:, rows]`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "truckscenes-devkit==1.2.0" "numpy<2.5"
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from truckscenes.utils.data_classes import LidarPointCloud

COUNT = 10_000
print("truckscenes-devkit", version("truckscenes-devkit"), "numpy", np.__version__)
seen = {}
for ratio in (1.0, 0.5):
    np.random.seed(0)
    cloud = LidarPointCloud(np.tile(np.arange(float(COUNT)), (4, 1)), np.arange(COUNT, dtype=np.uint64)[None])
    cloud.subsample(ratio)
    rows = cloud.points.shape[1]
    different = len(np.unique(cloud.points[0]))
    matched = float(np.mean(cloud.points[0] == cloud.timestamps[0, :rows]))
    seen[ratio] = rows, different, cloud.timestamps.shape[1]
    print(f"  ratio {ratio}: {rows} points, {different} of them different, {cloud.timestamps.shape[1]} times, {matched:.2%} their own")
    assert rows == int(ratio * COUNT) and matched < 0.01
assert seen[1.0][1] < 0.65 * COUNT and seen[0.5][1] < 0.41 * COUNT, "truckscenes-devkit no longer repeats points"
assert seen[0.5][2] == COUNT, "truckscenes-devkit no longer keeps all times"
print("points are drawn again and again, times not at all")
PYTHON
