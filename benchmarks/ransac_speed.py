# SPDX-License-Identifier: MIT
"""Our RANSAC compared with Open3D's, on the same matches of each real pair with the same settings.

Both get the same FPFH matches, distance, edge ratio 0.9 and number of iterations; both drop samples whose own
matches disagree with their pose (Open3D's distance checker). Open3D runs once as its users call it, on the
downsampled clouds (not at confidence 1, where that took minutes a run), and once on clouds that hold the matches
alone, which saves it moving the rest. A ratio below 1 means that ours is faster. "err" is the error of the pose found,
for information.

    python -m benchmarks.ransac_speed --data ../shared/data/real --pairs kitti-odo-5-to-0
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import hybridreg as hr
from benchmarks.measuring.alternate import race, real_pairs
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap
from hybridreg.runtime.open3d import load_open3d
from hybridreg.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Case:
    """Settings that both sides share."""

    confidence: float
    sample_size: int

    def ours(self) -> hr.Ransac:
        return hr.Ransac(confidence=self.confidence, sample_size=self.sample_size)


def methods(scene: Scene, matches: Correspondences, case: Case) -> dict[str, Callable[[], Array]]:
    """Ways to the pose, each from numpy arrays to a 4x4 array."""
    ours = case.ours()
    alone = replace(ours, backend="open3d", max_matches=max(len(matches), 3))
    runs = {
        "ours": lambda: ours(scene, matches, np.random.default_rng(0)).T,
        "open3d, matches": lambda: alone(scene, matches, np.random.default_rng(0)).T,
    }
    if case.confidence < 1.0:
        runs["open3d, clouds"] = lambda: on_clouds(scene, matches, ours)
    return runs


def on_clouds(scene: Scene, matches: Correspondences, settings: hr.Ransac) -> Array:
    """Open3D called as in its documentation."""
    o3d = load_open3d()
    reg = o3d.pipelines.registration
    assert matches.source_index is not None
    assert matches.target_index is not None
    rows = np.column_stack([matches.source_index, matches.target_index]).astype(np.int32)
    max_distance = 1.5 * scene.spacing
    result = reg.registration_ransac_based_on_correspondence(
        o3d.geometry.PointCloud(o3d.utility.Vector3dVector(scene.source.points)),
        o3d.geometry.PointCloud(o3d.utility.Vector3dVector(scene.target.points)),
        o3d.utility.Vector2iVector(rows),
        max_distance,
        ransac_n=settings.sample_size,
        checkers=[
            reg.CorrespondenceCheckerBasedOnEdgeLength(settings.edge_ratio),
            reg.CorrespondenceCheckerBasedOnDistance(max_distance),
        ],
        criteria=reg.RANSACConvergenceCriteria(settings.iterations, settings.confidence),
    )
    return np.asarray(result.transformation)


def error(T: Array, truth: Array) -> str:
    off = se3.inverse(truth) @ T
    return f"{se3.angle_deg(off[:3, :3]):.2f} deg {np.linalg.norm(T[:3, 3] - truth[:3, 3]):.2f} m"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", default="../shared/data/real")
    parser.add_argument("--pairs", nargs="*", default=[], help="names of pairs; all without")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    cases = [Case(confidence, size) for confidence in (0.999, 1.0) for size in (3, 4)]
    ratios: dict[tuple[Case, str], list[float]] = {}
    for labelled in real_pairs(options.data, options.pairs):
        scene = hr.VoxelGrid()(labelled.pair)
        matches = hr.Fpfh()(scene, Overlap.full(len(scene.source), len(scene.target)))
        print(f"{labelled.pair.id}: {len(matches)} matches", flush=True)
        for case in cases:
            timed = race(methods(scene, matches, case), options.rounds)
            for peer in timed.keys() - {"ours"}:
                ratios.setdefault((case, peer), []).append(timed["ours"].seconds / timed[peer].seconds)
            line = "  ".join(
                f"{name} {1e3 * run.seconds:8.1f} ms (err {error(run.result, labelled.T_target_source)})"
                for name, run in timed.items()
            )
            print(f"  confidence {case.confidence}, samples of {case.sample_size}: {line}", flush=True)
    for (case, peer), values in sorted(ratios.items(), key=str):
        print(
            f"confidence {case.confidence}, samples of {case.sample_size}: ours / {peer}: "
            f"median {np.median(values):.3f}, worst {max(values):.3f}, {len(values)} pairs"
        )


if __name__ == "__main__":
    main()
