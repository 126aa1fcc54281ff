# SPDX-License-Identifier: MIT
"""Mutual nearest neighbours among FPFH descriptors: our blocked matrix product compared with four libraries.

A ratio below 1 means that ours is faster. "agree" is the share of a peer's mutual matches that ours has too;
equal descriptors, and float32, make it less than 1.

    python -m benchmarks.nearest_speed --data ../shared/data/real --pairs kitti-odo-5-to-0
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

import hybridreg as hr
from benchmarks.measuring.alternate import race, real_pairs
from hybridreg.geometry.nearest_descriptors import nearest
from hybridreg.runtime.open3d import load_open3d

Array = NDArray[np.float64]
Matches = NDArray[np.int64]


def ours(a: Array, b: Array) -> Matches:
    found = nearest(a, b)
    return np.column_stack([np.flatnonzero(found.mutual), found.row[found.mutual]])


def scipy_tree(a: Array, b: Array) -> Matches:
    from scipy.spatial import cKDTree

    return _mutual(cKDTree(b).query(a, workers=-1)[1], cKDTree(a).query(b, workers=-1)[1])


def sklearn_brute(a: Array, b: Array) -> Matches:
    from sklearn.metrics import pairwise_distances_argmin

    a, b = a.astype(np.float32), b.astype(np.float32)
    return _mutual(pairwise_distances_argmin(a, b), pairwise_distances_argmin(b, a))


def opencv_brute(a: Array, b: Array) -> Matches:
    import cv2

    found = cv2.BFMatcher(cv2.NORM_L2, crossCheck=True).match(a.astype(np.float32), b.astype(np.float32))
    return np.array([(m.queryIdx, m.trainIdx) for m in found])


def open3d_tree(a: Array, b: Array) -> Matches:
    registration = load_open3d().pipelines.registration
    features = []
    for rows in (a, b):
        features.append(registration.Feature())
        features[-1].data = rows.T
    return np.asarray(registration.correspondences_from_features(*features, mutual_filter=True))


def _mutual(forth: Matches, back: Matches) -> Matches:
    rows = np.flatnonzero(back[forth] == np.arange(len(forth)))
    return np.column_stack([rows, forth[rows]])


PEERS: dict[str, Callable[[Array, Array], Matches]] = {
    "scipy cKDTree": scipy_tree,
    "scikit-learn": sklearn_brute,
    "opencv BFMatcher": opencv_brute,
    "open3d": open3d_tree,
}


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", default="../shared/data/real")
    parser.add_argument("--pairs", nargs="*", default=[], help="names of pairs; all without")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    ratios: dict[str, list[float]] = {name: [] for name in PEERS}
    for labelled in real_pairs(options.data, options.pairs):
        scene = hr.VoxelGrid()(labelled.pair)
        a, b = (hr.Fpfh().features(scene, side) for side in ("source", "target"))
        a, b = a[a.any(axis=1)], b[b.any(axis=1)]
        runs = {name: partial(method, a, b) for name, method in {"ours": ours, **PEERS}.items()}
        timed = race(runs, options.rounds)
        taken = {name: run.seconds for name, run in timed.items()}
        found = {tuple(row) for row in timed["ours"].result}
        print(f"{labelled.pair.id}: {len(a)} x {len(b)}, ours {1e3 * taken['ours']:.0f} ms")
        for name in PEERS:
            ratios[name].append(taken["ours"] / taken[name])
            theirs = {tuple(row) for row in timed[name].result}
            print(
                f"  {name:18s} {1e3 * taken[name]:6.0f} ms, ours / theirs {taken['ours'] / taken[name]:.2f}, "
                f"agree {len(found & theirs) / len(theirs):.3f}",
                flush=True,
            )
    for name, values in ratios.items():
        if values:
            print(
                f"ours / {name}: median {np.median(values):.2f}, worst {max(values):.2f}, {len(values)} pairs"
            )


if __name__ == "__main__":
    main()
