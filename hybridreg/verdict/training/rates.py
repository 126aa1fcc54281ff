# SPDX-License-Identifier: MIT
"""How often the verdict is right on real pairs, for right and for plausible wrong poses.

    python -m hybridreg.verdict.training.rates --data ../shared/data/real

Wrong poses are those that a registration would return: every start (half a turn, 5 and 10 m along and across the
street, for clouds of different recordings the best of many starts) is refined by small_gicp before it is judged.
"""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter, defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.voxel import VoxelGrid
from hybridreg.cloud import PointCloud
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair
from hybridreg.scene import Scene
from hybridreg.verdict import judge

Array = NDArray[np.float64]
Case = tuple[str, Array, Array | None]  # kind, pose, truth

# Within these a refined pose counts as right, beyond those as wrong (degrees, metres); between them it is left out.
RIGHT, WRONG = (2.0, 0.5), (5.0, 2.0)


class Clouds:
    """A source and a target, ready for small_gicp and for the verdict."""

    def __init__(self, source: Array, target: Array) -> None:
        import small_gicp

        self.source, self.target = source, target
        self.gicp_source, _ = small_gicp.preprocess_points(source, downsampling_resolution=0.4)
        self.gicp_target, self.gicp_tree = small_gicp.preprocess_points(target, downsampling_resolution=0.4)
        self.pair = Pair(source=PointCloud.of(source), target=PointCloud.of(target))

    def refine(self, T: Array) -> Array:
        import small_gicp

        for distance in (3.0, 1.0):
            T = small_gicp.align(
                self.gicp_target, self.gicp_source, self.gicp_tree, T, max_correspondence_distance=distance
            ).T_target_source
        return T

    def covered(self, T: Array, distance: float = 0.5) -> NDArray[np.bool_]:
        """Whether each (seventh) source point has a target point near by."""
        from scipy.spatial import cKDTree

        tree = cKDTree(self.target[::2])
        return np.isfinite(tree.query(se3.apply(T, self.source[::7]), distance_upper_bound=distance)[0])


def perturbed(clouds: Clouds, truth: Array) -> Iterator[Case]:
    """Poses of one pair: the true one, then half turns and slides, refined."""
    yield "true pose", truth, truth
    yield "true pose, refined", clouds.refine(truth), truth
    moved = se3.apply(truth, clouds.source[::7])[clouds.covered(truth)]
    spread = np.linalg.eigh(np.cov(moved.T))[1]
    up, street, across = spread[:, 0], spread[:, 2], spread[:, 1]
    half = se3.rotation_about(np.pi * up)
    for centre in (moved.mean(axis=0), truth[:3, 3]):
        turned = se3.about(centre, half) @ truth
        yield "half a turn, refined", clouds.refine(turned), truth
    for direction, lengths in ((street, (-10.0, -5.0, 5.0, 10.0)), (across, (-5.0, 5.0))):
        for length in lengths:
            slid = se3.from_rt(np.eye(3), length * direction) @ truth
            yield "slid 5 or 10 m, refined", clouds.refine(slid), truth


def best_wrong(clouds: Clouds, rng: np.random.Generator, n_starts: int = 8) -> Array:
    """Best covered of KISS-Matcher's pose and random yaws, all refined."""
    starts = [se3.yaw(360.0 * i / n_starts) for i in range(n_starts)]
    starts = [se3.from_rt(T[:3, :3], rng.uniform([-5, -5, -1], [5, 5, 1])) for T in starts]
    starts += [T for voxel in (0.5, 1.0) if (T := _kiss(clouds, voxel)) is not None]
    return max((clouds.refine(T) for T in starts), key=lambda T: clouds.covered(T).mean())


def _kiss(clouds: Clouds, voxel: float) -> Array | None:
    from hybridreg.geometry.voxel_cells import voxel_centroids

    try:
        import kiss_matcher
    except ImportError:
        return None
    thinned = [voxel_centroids(cloud, voxel) for cloud in (clouds.source, clouds.target)]
    if min(map(len, thinned)) < 100:  # its wheel crashes on a handful of points
        return None
    matcher = kiss_matcher.KISSMatcher(kiss_matcher.KISSMatcherConfig(voxel))
    found = matcher.estimate(*(cloud.astype(np.float32) for cloud in thinned))
    return se3.from_rt(np.asarray(found.rotation), np.ravel(found.translation))


def cases(folder: Path) -> Iterator[tuple[str, Scene, Case]]:
    """Every pose of every pair, and one of each two recordings."""
    names = sorted(p.parent.name for p in folder.glob("*/source.npz"))
    for name in names:
        clouds = Clouds(_read(folder / name, "source"), _read(folder / name, "target"))
        truth = np.array(json.loads((folder / name / "meta.json").read_text())["T_target_source"])
        scene = VoxelGrid()(clouds.pair)
        for case in perturbed(clouds, truth):
            yield name, scene, case
    recordings = {_recording(name): name for name in reversed(names)}
    for source in recordings.values():
        for target in recordings.values():
            if source != target:
                clouds = Clouds(_read(folder / source, "source"), _read(folder / target, "target"))
                wrong = best_wrong(clouds, np.random.default_rng(0))
                yield f"{source} on {target}", VoxelGrid()(clouds.pair), ("different places", wrong, None)


def _read(folder: Path, side: str) -> Array:
    with np.load(folder / f"{side}.npz") as file:
        return np.asarray(file["xyz"], dtype=np.float64)


def _recording(name: str) -> str:
    parts = name.split("-")
    return "-".join(parts[:2]) if parts[0] in ("kitti", "opencalib") else parts[0]


def _is_right(T: Array, truth: Array | None) -> bool | None:
    if truth is None:
        return False
    error = se3.angle_deg(T[:3, :3] @ truth[:3, :3].T), float(np.linalg.norm(T[:3, 3] - truth[:3, 3]))
    if error[0] <= RIGHT[0] and error[1] <= RIGHT[1]:
        return True
    return None if error[0] <= WRONG[0] and error[1] <= WRONG[1] else False


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=Path("../shared/data/real"))
    table: dict[str, Counter[str]] = defaultdict(Counter)
    seconds = []
    for name, scene, (kind, T, truth) in cases(parser.parse_args().data):
        right = _is_right(T, truth)
        if right is None:
            continue
        start = time.perf_counter()
        judged = judge(scene, Pose(T), Correspondences.none())
        seconds.append(time.perf_counter() - start)
        row = f"{kind}: {'right' if right else 'wrong'}"
        table[row][judged.verdict] += 1
        if (judged.verdict == "ok") != right or (not right and judged.verdict != "failed"):
            print(
                f"{row:40s} {name:50s} {judged.verdict} {judged.confidence:.3f} {judged.reasons[0]}",
                flush=True,
            )
    print(f"{'':40s} {'ok':>9s} {'doubtful':>9s} {'failed':>9s}")
    for row, words in sorted(table.items()):
        print(f"{row:40s} " + " ".join(f"{words[word]:9d}" for word in ("ok", "doubtful", "failed")))
    print(f"judge(): median {np.median(seconds):.3f} s, longest {max(seconds):.3f} s")


if __name__ == "__main__":
    main()
