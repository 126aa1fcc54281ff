# SPDX-License-Identifier: MIT
"""Small data sets and methods whose right answers are known. Importable by worker processes."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.cloud import PointCloud
from hybridreg.data.dataset import Dataset
from hybridreg.eval.run.row import Row
from hybridreg.geometry import se3
from hybridreg.geometry.fitness import Overlay
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.pair import LabelledPair, Pair
from hybridreg.pipeline import Trace
from hybridreg.result import RegistrationResult
from hybridreg.scene import Level, Scene


class Scattered(Dataset):
    """`n` pairs whose target is the moved source, row by row; it did not see half of the source."""

    def __init__(self, n: int = 4, broken: tuple[int, ...] = (), offset: float = 0.0) -> None:
        self.n, self.broken, self.offset = n, broken, offset

    @property
    def ids(self) -> tuple[str, ...]:
        return tuple(f"pair-{i}" for i in range(self.n))

    def load(self, index: int) -> LabelledPair:
        if index in self.broken:
            raise OSError(f"pair-{index}: the disk is gone")
        rng = np.random.default_rng(index)
        source = rng.uniform(-20.0, 20.0, (400, 3))
        T = se3.from_rt(se3.random_rotation(rng), rng.uniform(-5.0, 5.0, 3))
        target = se3.apply(T, source[:200])
        pair = Pair(
            source=PointCloud.of(source + self.offset),
            target=PointCloud.of(target + self.offset),
            id=self.ids[index],
        )
        shifted = T.copy()
        shifted[:3, 3] += self.offset - T[:3, :3] @ np.full(3, self.offset)
        return LabelledPair(pair=pair, T_target_source=shifted, overlap=0.5)


def kabsch(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Pose of row-by-row matches, written out here so that no stage under test is needed."""
    p, q = source.mean(axis=0), target.mean(axis=0)
    R = se3.project((target - q).T @ (source - p))
    return se3.from_rt(R, q - R @ p)


@dataclass(frozen=True, kw_only=True)
class RowByRow:
    """A traceable method that finds the true pose, then its refinement moves it by `slip` metres."""

    slip: float = 0.0
    found: bool = True

    def to_spec(self) -> dict[str, Any]:
        return {"estimate": {"stage": "row-by-row", "slip": self.slip}}

    def trace(self, pair: Pair, *, seed: int = 0) -> Trace:
        source, target = pair.source.points, pair.target.points
        matches = Correspondences.of(source[:200], target)
        T = kabsch(source[:200], target)
        refined = T.copy()
        refined[0, 3] += self.slip
        mask = Overlap(np.r_[np.full(300, 0.9), np.full(100, 0.1)], np.ones(200))
        scene = Scene(
            pair=pair, source=Level(points=source, spacing=0.1), target=Level(points=target, spacing=0.1)
        )
        poses = Pose(T, found=self.found), Pose(refined, found=self.found)
        return Trace(scene, mask, matches, *poses, {"match": 0.1, "estimate": 0.2})

    def conclude(self, trace: Trace, *, seed: int = 0) -> RegistrationResult:
        from hybridreg.frames import raise_matches, raise_pose

        pair = trace.scene.pair
        confidence = float(np.random.default_rng(seed).uniform())
        return RegistrationResult(
            transformation=raise_pose(trace.refined.T, pair), verdict="ok", confidence=confidence,
            reasons=("rows agree",), overlay=_HALF,
            information=np.eye(6), rivals=np.zeros((0, 4, 4)),
            matches=raise_matches(trace.matches, pair), evidence={"violations": float("nan")}, notes=(),
            seconds=trace.seconds, peak_memory_mb=None, seed=seed, spec=self.to_spec(),
        )  # fmt: skip


# One of two points lies on the only one of the target.
_HALF = Overlay(np.array([[0.0, 0.0, 0.0], [5.0, 5.0, 5.0]]), np.zeros((1, 3)), np.eye(4), 0.1)


@dataclass(frozen=True, kw_only=True)
class Moody:
    """A plain callable: right, wrong, silent, broken or mad, by the pair's number; it may take its time."""

    moods: tuple[str, ...] = ("right", "raise", "none", "nan", "wrong")
    seconds: float = 0.0
    log: str = ""

    def __call__(self, pair: Pair, seed: int) -> Any:
        time.sleep(self.seconds)
        if self.log:
            with Path(self.log).open("a") as file:
                file.write(f"{pair.id} {os.getpid()}\n")
        mood = self.moods[int(pair.id.partition("@")[0].rpartition("-")[2]) % len(self.moods)]
        if mood == "raise":
            raise RuntimeError(f"{pair.id}\nis beyond me")
        if mood == "die":
            os._exit(11)
        answers = {"none": None, "nan": np.full((4, 4), np.nan), "wrong": np.eye(4)}
        return answers[mood] if mood in answers else kabsch(pair.source.points[:200], pair.target.points)


@dataclass(frozen=True)
class Logged:
    """A plain callable that finds nothing, and writes down when it began and ended."""

    log: str
    seconds: float = 0.3

    def __call__(self, pair: Pair, seed: int) -> None:
        began = time.time()
        time.sleep(self.seconds)
        with Path(self.log).open("a") as file:
            file.write(f"{began} {time.time()}\n")

    def at_once(self) -> int:
        """The most pairs that ran at one time."""
        spans = [tuple(map(float, line.split())) for line in Path(self.log).read_text().splitlines()]
        return max(sum(began <= start < ended for began, ended in spans) for start, _ in spans)


def row(index: int, rre_deg: float, rte_m: float, **changes: Any) -> Row:
    """A row whose pose is off by just these errors."""
    truth = se3.from_rt(se3.random_rotation(np.random.default_rng(index)), np.array([3.0, -2.0, 1.0]))
    T = truth.copy()
    T[:3, :3] = truth[:3, :3] @ se3.yaw(rre_deg)[:3, :3]
    T[0, 3] += rte_m
    given = {"index": index, "id": f"pair-{index}", "T": T.tolist(), "T_true": truth.tolist(), **changes}
    return Row(**given)
