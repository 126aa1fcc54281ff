# SPDX-License-Identifier: MIT
"""Our voxel grid compared with Open3D's, on both clouds of each real pair.

Both take a numpy array and return one; Open3D is timed with its conversion from numpy and without. A ratio below
1 means that ours is faster.

    python -m benchmarks.voxel_speed --data ../shared/data/real
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from benchmarks.measuring.alternate import race, real_pairs
from hybridreg.geometry.voxel_cells import voxel_centroids
from hybridreg.resolution import default_voxel
from hybridreg.runtime.open3d import load_open3d

Array = NDArray[np.float64]


def compare(points: Array, voxel: float) -> dict[str, float]:
    """Seconds of each method for one cloud."""
    o3d = load_open3d()
    points = points.copy()  # Open3D refuses read-only arrays
    ready = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))

    def open3d_from_numpy() -> Array:
        cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(points))
        return np.asarray(cloud.voxel_down_sample(voxel).points)

    rivals = {
        "ours": lambda: voxel_centroids(points, voxel),
        "open3d": open3d_from_numpy,
        "open3d, converted before": lambda: ready.voxel_down_sample(voxel),
    }
    return {name: timed.seconds for name, timed in race(rivals, rounds=7).items()}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", default="../shared/data/real")
    parser.add_argument("--pairs", nargs="*", default=[], help="names of pairs; all without")
    options = parser.parse_args()
    ratios: dict[str, list[float]] = {"open3d": [], "open3d, converted before": []}
    for labelled in real_pairs(options.data, options.pairs):
        pair = labelled.pair
        voxel = default_voxel(pair.source, pair.target)
        for name, cloud in (("source", pair.source), ("target", pair.target)):
            taken = compare(cloud.points, voxel)
            for peer, values in ratios.items():
                values.append(taken["ours"] / taken[peer])
            times = "  ".join(f"{peer} {1e3 * t:6.1f} ms" for peer, t in taken.items())
            print(f"{pair.id:32s} {name} {len(cloud):7d} points, voxel {voxel:.2f} m  {times}", flush=True)
    for peer, values in ratios.items():
        if values:
            spread = f"median {np.median(values):.2f}, worst {max(values):.2f}"
            print(f"ours / {peer}: {spread}, {len(values)} clouds")


if __name__ == "__main__":
    main()
