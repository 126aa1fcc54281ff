#!/usr/bin/env bash
# kiss-icp 1.3.0 and genz-icp 0.3.2 take a scan with a time for each point, by the same call, and undo the sensor's own motion
# (`deskew`). kiss-icp moves the points to where the sensor was at the end of the scan, genz-icp to the middle: one drive, one
# set of scans, and `last_pose` of the two lies half a scan's way apart, in the direction of travel. Neither can be told
# which moment is wanted, and nothing says which it is.
#
# Guess before it was run: both give the pose at the middle of the scan.
# For whom it matters: whoever scores odometries against a truth by the stamps of the scans, which are mostly those of the
# start: at 20 m/s and 10 scans a second kiss-icp is two metres ahead of them and genz-icp one, of which an alignment takes
# away what is constant, and nothing in curves; and whoever lays deskewed scans of one beside poses of the other.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/python" -m pip install --quiet "kiss-icp==1.3.0" "genz-icp==0.3.2" "numpy<2.3"
cd "$folder"
HOME="$folder" "$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from genz_icp.config import GenZConfig
from genz_icp.genz_icp import GenZICP
from kiss_icp.config import KISSConfig
from kiss_icp.kiss_icp import KissICP

rng = np.random.default_rng(0)
street = [np.column_stack([rng.uniform(-40.0, 100.0, 350_000), rng.uniform(-12.0, 12.0, 350_000), np.full(350_000, -1.7)])]
for _ in range(80):  # fronts and sides of things along it
    x, y, high = rng.uniform(-40.0, 100.0), rng.choice([-1, 1]) * rng.uniform(5.0, 12.0), rng.uniform(1.0, 8.0)
    long, wide = rng.uniform(1.0, 4.0, 2)
    u = rng.uniform(0.0, 1.0, (3, 3000, 2))
    up = high * u[..., 1] - 1.7
    none = np.zeros(3000)
    street += [
        np.column_stack([x + none, y + wide * (u[0, :, 0] - 0.5), up[0]]),
        np.column_stack([x + long * u[1, :, 0], y - np.sign(y) * wide / 2 + none, up[1]]),
        np.column_stack([x + long + none, y + wide * (u[2, :, 0] - 0.5), up[2]]),
    ]
street = np.vstack(street)
# Metres along the street in each scan: at rest, faster and faster, then constant.
steps = np.concatenate([np.zeros(5), np.linspace(0.0, 1.5, 15), np.full(15, 1.5)])
starts = np.concatenate([[0.0], np.cumsum(steps)])


def scan(k):
    near = street[np.abs(street[:, 0] - starts[k]) < 40.0]
    points = near[rng.choice(len(near), 40_000, replace=False)]
    # A turn begins behind the sensor.
    times = (np.arctan2(points[:, 1], points[:, 0] - starts[k] - steps[k] / 2.0) + np.pi) / (2.0 * np.pi)
    points[:, 0] -= starts[k] + steps[k] * times
    return points + rng.normal(0.0, 0.01, points.shape), times


configs = {KissICP: KISSConfig(), GenZICP: GenZConfig()}
for config in configs.values():
    config.data.max_range, config.data.min_range, config.data.deskew = 40.0, 0.5, True
    config.mapping.voxel_size = 0.5
kiss, genz = (kind(config) for kind, config in configs.items())
for k in range(len(steps)):
    points, times = scan(k)
    for odometry in (kiss, genz):
        odometry.register_frame(points, times)

start, end = starts[-2], starts[-1]
parts = {name: (each.last_pose[0, 3] - start) / (end - start) for name, each in (("kiss-icp", kiss), ("genz-icp", genz))}
print("kiss-icp", version("kiss-icp"), "genz-icp", version("genz-icp"), "numpy", np.__version__)
print(f"  the sensor goes {end - start:.1f} m during the last scan")
for name, part in parts.items():
    print(f"  {name}: the pose is that after {100 * part:.0f} % of the scan")
assert abs(parts["kiss-icp"] - 1.0) < 0.1, "kiss-icp's pose is no longer that of the end"
assert abs(parts["genz-icp"] - 0.5) < 0.1, "genz-icp's pose is no longer that of the middle"
print("kiss and genz pose another moment")
PYTHON
