# SPDX-License-Identifier: MIT
"""The weights of the verdict's confidence, from simulated scenes alone.

    python -m benchmarks.verdict_weights --worlds 72

Each world (streets, crossings, yards, woods, rooms, corridors) is seen by two sensors, one in ten upside down and
one in ten tilted by 30 degrees, with a third of the cars moved in between. Right poses, refined or slightly off,
stand against half turns, slides, the best of several random yaws, and the best pose on another world's target; all
wrong ones are refined by small_gicp first. Prints the logistic regression's weights, then how it does on worlds
that it was not fitted to (eight-fold, divided by world).
"""

from __future__ import annotations

import argparse
import copy
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hybridreg import se3
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.cloud import PointCloud
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair
from hybridreg.verdict import judge
from hybridreg.verdict.confidence import MARGIN_COUNTS, WEIGHTS, confidence

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "tests" / "verdict"))
import worlds

Array = NDArray[np.float64]
KINDS = ("street", "crossing", "yard", "wood", "room", "corridor")
SOURCES = ("rings16", "rings32", "rings64", "hemisphere", "rosette", "raster")
TARGETS = ("rings32", "rings64", "rings64", "hemisphere", "rings16")


@dataclass(frozen=True, eq=False)
class Sight:
    """One world as two sensors saw it; lengths of the search in units of `voxel`."""

    kind: str
    source: Array
    target: Array
    truth: Array
    T_world_target: Array
    voxel: float

    @property
    def indoor(self) -> bool:
        return self.kind in ("room", "corridor")


def build(kind: str, rng: np.random.Generator) -> worlds.World:
    """A world of a kind."""
    if kind in ("street", "crossing"):
        return worlds.street(rng, crossing=kind == "crossing")
    if kind in ("room", "corridor"):
        return worlds.room(rng, corridor=kind == "corridor")
    return worlds.yard(rng) if kind == "yard" else worlds.wood(rng)


def sight(i: int) -> Sight:
    """The i-th pair of scans."""
    rng = np.random.default_rng(1000 + i)
    kind = KINDS[i % len(KINDS)]
    before, indoor = build(kind, rng), kind in ("room", "corridor")
    after = copy.deepcopy(before)
    for j, (centre, half, yaw) in enumerate(after.boxes):
        if not indoor and half[2] < 1.0 and rng.random() < 0.3:
            after.boxes[j] = (centre + [rng.normal(0.0, 5.0), 0.0, 0.0], half, yaw)
    z = 1.3 if indoor else 1.8
    apart = rng.uniform(-1, 1) if indoor else rng.choice([0, 3, 8, 15]) * rng.choice([-1, 1])
    tilt = rng.choice([180.0, 30.0, rng.normal(0.0, 2.0)], p=[0.1, 0.1, 0.8])
    T_world_target = worlds.sensor_pose(0, rng.uniform(-0.3, 0.3), z, rng.uniform(0, 360), rng.normal(0, 1))
    T_world_source = worlds.sensor_pose(apart, rng.uniform(-0.5, 0.5), z, rng.uniform(0, 360), tilt)
    source = worlds.scan(after, str(rng.choice(SOURCES)), T_world_source, rng)
    target = worlds.scan(before, str(rng.choice(TARGETS)), T_world_target, rng)
    truth = se3.inverse(T_world_target) @ T_world_source
    return Sight(kind, source, target, truth, T_world_target, 0.15 if indoor else 0.5)


class Search:
    """small_gicp on one source and one target, at the scale of the place."""

    def __init__(self, source: Array, target: Array, voxel: float) -> None:
        import small_gicp
        from scipy.spatial import cKDTree

        self.voxel, self.few = voxel, source[::5]
        self.tree = cKDTree(target[::2])
        self.source, _ = small_gicp.preprocess_points(source, downsampling_resolution=0.8 * voxel)
        self.target, self.target_tree = small_gicp.preprocess_points(
            target, downsampling_resolution=0.8 * voxel
        )

    def refine(self, T: Array) -> Array:
        import small_gicp

        for distance in (6.0 * self.voxel, 2.0 * self.voxel):
            T = small_gicp.align(
                self.target, self.source, self.target_tree, T, max_correspondence_distance=distance
            ).T_target_source
        return T

    def covered(self, T: Array) -> float:
        gaps = self.tree.query(se3.apply(T, self.few), distance_upper_bound=self.voxel)[0]
        return float(np.isfinite(gaps).mean())

    def best(self, level: Array, up: Array, rng: np.random.Generator, n_starts: int = 6) -> Array:
        """Best covered of random turns about `up` after `level`, with random shifts, refined."""
        starts = []
        for i in range(n_starts):
            R = se3.rotation_about(np.radians(360.0 * i / n_starts + rng.uniform(0, 20)) * up) @ level[:3, :3]
            shift = rng.uniform(-10.0, 10.0, 3) * self.voxel
            starts.append(se3.from_rt(R, level[:3, 3] + shift - up * (up @ shift)))
        return max((self.refine(T) for T in starts), key=self.covered)


def poses(here: Sight, rng: np.random.Generator) -> Iterator[Array]:
    """Poses of one pair to judge, right and wrong."""
    search, voxel, truth = Search(here.source, here.target, here.voxel), here.voxel, here.truth
    up, street = here.T_world_target[2, :3], here.T_world_target[0, :3]
    near = truth @ se3.exp(rng.normal(0.0, 1.0, 6) * np.repeat([0.003, 0.1 * voxel], 3))
    yield near
    yield search.refine(near)
    half = se3.rotation_about(np.pi * up)
    yield search.refine(se3.from_rt(half @ truth[:3, :3], truth[:3, 3]))
    for length in (-20.0, -10.0, 10.0, 20.0):
        yield search.refine(se3.from_rt(np.eye(3), length * voxel * street) @ truth)
    yield search.best(truth, up, rng)


def elsewhere(here: Sight, there: Sight, rng: np.random.Generator) -> Array:
    """Best pose of one world's source on another's target, both upright, the sensors at one height."""
    level = (there.T_world_target[:3, :3].T @ here.T_world_target[:3, :3]) @ here.truth[:3, :3]
    search = Search(here.source, there.target, here.voxel)
    return search.best(se3.from_rt(level, np.zeros(3)), there.T_world_target[2, :3], rng)


def is_right(T: Array, here: Sight) -> bool | None:
    """None between right (2 degrees and 0.5 m; 0.2 m in a room) and wrong (5 degrees or 2 m; 0.5 m)."""
    angle = se3.angle_deg(T[:3, :3] @ here.truth[:3, :3].T)
    metres = float(np.linalg.norm(T[:3, 3] - here.truth[:3, 3]))
    if angle < 2.0 and metres < (0.2 if here.indoor else 0.5):
        return True
    return False if angle > 5.0 or metres > (0.5 if here.indoor else 2.0) else None


def evidence(n_worlds: int) -> Iterator[tuple[dict[str, float], bool, int]]:
    """Evidence, whether the pose is right, and the world."""
    sights = [sight(i) for i in range(n_worlds)]
    for i, here in enumerate(sights):
        rng = np.random.default_rng(i)
        there = sights[(i + len(KINDS)) % n_worlds]
        made = [(here, T, is_right(T, here)) for T in poses(here, rng)] + [
            (there, elsewhere(here, there, rng), False)
        ]
        for other, T, right in made:
            if right is not None:
                pair = Pair(source=PointCloud.of(here.source), target=PointCloud.of(other.target))
                yield judge(VoxelGrid()(pair), Pose(T), Correspondences.none()).evidence, right, i


def main() -> None:
    from sklearn.linear_model import LogisticRegression
    from sklearn.model_selection import GroupKFold, cross_val_predict

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--worlds", type=int, default=72)
    found = list(evidence(parser.parse_args().worlds))
    X = np.array([[numbers[name] for name in WEIGHTS] for numbers, _, _ in found])
    X[:, -1] = np.clip(X[:, -1], -MARGIN_COUNTS, MARGIN_COUNTS)
    right, world = np.array([r for _, r, _ in found]), np.array([w for _, _, w in found])
    # Both kinds weigh the same: how often a pipeline is right is not for the verdict to assume.
    model = LogisticRegression(C=30.0, class_weight="balanced")
    unseen = cross_val_predict(model, X, right, groups=world, cv=GroupKFold(8), method="predict_proba")[:, 1]
    model.fit(X, right)
    print(
        "weights",
        dict(zip(WEIGHTS, model.coef_[0].round(2), strict=True)),
        "intercept",
        model.intercept_.round(2),
    )
    stored = np.array([confidence(numbers) for numbers, _, _ in found])
    report("unseen worlds", unseen, right, world)
    report("weights in use", stored, right, world)


def report(name: str, p: Array, right: NDArray[np.bool_], world: NDArray[np.int64]) -> None:
    """Print how probabilities `p` do, in all and for each kind of world."""
    from sklearn.metrics import brier_score_loss

    print(f"{name}: Brier score {brier_score_loss(right, p):.3f}")
    every = ("all", np.ones(len(world), dtype=bool))
    kinds = [(kind, np.array([KINDS[w % len(KINDS)] == kind for w in world])) for kind in KINDS]
    for kind, here in (every, *kinds):
        good, bad = p[right & here], p[~right & here]
        print(
            f"  {kind:9s} of {len(good):3d} right poses {np.mean(good >= 0.95):4.0%} ok, {np.mean(good < 0.5):4.0%} "
            f"failed; of {len(bad):3d} wrong ones {np.sum(bad >= 0.95):2d} ok, {np.mean(bad < 0.5):4.0%} failed"
        )


if __name__ == "__main__":
    main()
