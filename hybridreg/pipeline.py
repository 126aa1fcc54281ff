# SPDX-License-Identifier: MIT
"""A registration pipeline: five slots, then the verdict."""

from __future__ import annotations

import os
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg import fitting, presets, spec
from hybridreg.cloud import PointCloud
from hybridreg.frames import lower_matches, raise_matches, raise_pose
from hybridreg.geometry.se3 import project
from hybridreg.io import shipped_weights
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.pair import Pair
from hybridreg.resolution import tolerance
from hybridreg.result import RegistrationResult
from hybridreg.runtime.resources import peak_memory_mb, reset_peak_memory, stopwatch
from hybridreg.scene import Scene
from hybridreg.slots import SLOTS
from hybridreg.stage import Stage, own_params


@dataclass(frozen=True, eq=False)
class Trace:
    """Everything that the stages of one run produced, in the levels' frames."""

    scene: Scene
    overlap: Overlap
    matches: Correspondences
    estimated: Pose
    refined: Pose
    seconds: dict[str, float]


@dataclass(frozen=True, kw_only=True)
class Pipeline(Stage):
    """Five stages, each a registered name, a table of a name and fields, or a stage of your own.

    Parameters
    ----------
    voxel : float or None
        Shorthand for `downsample=VoxelGrid(voxel=...)`, metres: one number is a whole configuration.

    Raises
    ------
    KeyError
        A name that nobody registered.
    ValueError
        Stages that do not fit together; the message names one that would.
    """

    voxel: float | None = None
    downsample: Any = "voxel"
    overlap: Any = "none"
    match: Any = "fpfh"
    estimate: Any = "ransac"
    refine: Any = "gicp"

    def __post_init__(self) -> None:
        for slot in SLOTS:
            given = getattr(self, slot)
            if isinstance(given, (str, Mapping)):
                object.__setattr__(self, slot, spec.from_table(given, slot))
        object.__setattr__(self, "downsample", fitting.with_voxel(self.downsample, self.voxel))
        fitting.check(self)

    @classmethod
    def preset(cls, name: str, *, voxel: float | None = None) -> Pipeline:
        """Pipeline of a name that `hybridreg.presets.names()` lists.

        Raises
        ------
        KeyError
            No preset of that name.
        MissingWeights
            It needs weights that do not come with this version; a FileNotFoundError.
        """
        slots = presets.load(name)
        shipped_weights.require(slots, f"preset {name!r}")
        return cls(voxel=voxel, **slots)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Pipeline:
        """Read a pipeline from a TOML file that `save` wrote, or that a person did."""
        return cls(**presets.read(path))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the pipeline as TOML, whole or not at all."""
        presets.write(path, self.to_spec())

    def to_spec(self) -> dict[str, Any]:
        """One table a slot."""
        return {slot: spec.to_table(getattr(self, slot), slot) for slot in SLOTS}

    def swap(self, **stages: Any) -> Pipeline:
        """A copy with other stages in some slots: `pipe.swap(estimate="ransac")`."""
        unknown = set(stages) - {*SLOTS, "voxel"}
        if unknown:
            raise TypeError(
                f"no slot is called {', '.join(sorted(unknown))}; the slots are {', '.join(SLOTS)}"
            )
        if "downsample" in stages:
            stages.setdefault("voxel", None)
        elif stages.get("voxel") is not None:
            stages["downsample"] = "voxel"
        return type(self)(**{**own_params(self), **stages})

    def __call__(self, source: Any, target: Any, image: Any = None, *, seed: int = 0) -> RegistrationResult:
        """Align two clouds; takes anything that `PointCloud.of` does."""
        return self.run(Pair.of(source, target, image), seed=seed)

    def run(self, pair: Pair, *, seed: int = 0, matches: Any = None) -> RegistrationResult:
        """Align a pair.

        Parameters
        ----------
        seed : int
            With the pair's id it fixes every random choice.
        matches : Correspondences, (K, 2) integer rows of the clouds' points, or None
            Your own matches, in the coordinates that you gave; the match stage is then skipped.

        Raises
        ------
        ValueError
            For clouds that no pose can be computed from (the message names cloud, number and cure), or a negative seed.
        """
        reset_peak_memory()
        return self.conclude(self.trace(pair, seed=seed, matches=matches), seed=seed)

    def conclude(self, trace: Trace, *, seed: int = 0) -> RegistrationResult:
        """The verdict on a traced run, and its result in the user's coordinates."""
        pair = trace.scene.pair
        with stopwatch(trace.seconds, "verdict"):
            from hybridreg.verdict import judge

            judgement = judge(trace.scene, trace.refined, trace.matches)
        return RegistrationResult(
            transformation=raise_pose(trace.refined.T, pair),
            rivals=np.array([raise_pose(T, pair) for T in judgement.rivals]).reshape(-1, 4, 4),
            matches=raise_matches(trace.matches, pair),
            verdict=judgement.verdict,
            confidence=judgement.confidence,
            reasons=judgement.reasons,
            overlay=judgement.overlay,
            information=judgement.information,
            evidence=judgement.evidence,
            notes=tuple(trace.scene.notes),
            seconds=trace.seconds,
            peak_memory_mb=peak_memory_mb(),
            seed=seed,
            spec=self.to_spec(),
            tolerance=tolerance(pair.source, pair.target),
        )

    def trace(self, pair: Pair, *, seed: int = 0, matches: Any = None) -> Trace:
        """Run the stages and keep what each of them produced."""
        from hybridreg.evidence.match_agreement import of_most

        fitting.check_image(self, pair)
        fitting.check_seed(seed)
        rng = np.random.default_rng([seed, zlib.crc32(pair.id.encode())])
        seconds: dict[str, float] = {}
        with stopwatch(seconds, "downsample"):
            scene = self.downsample(pair)
        fitting.check_scene(scene)
        for name, cloud in (("source", scene.pair.source), ("target", scene.pair.target)):
            if len(cloud.seen.places) != 1:
                scene.note(f"the {name} was seen from {_places(cloud)}")
            if cloud.dropped:
                scene.note(
                    f"{cloud.dropped} points of the {name} were missing (not finite, or at 0, 0, 0) and were dropped"
                )
        with stopwatch(seconds, "overlap"):
            overlap = self.overlap(scene)
        with stopwatch(seconds, "match"):
            if matches is None:
                found = scene.matched(self.match(scene, overlap))
            else:
                found = scene.matched(lower_matches(matches, pair))
        with stopwatch(seconds, "estimate"):
            estimated = _proper(self.estimate(scene, found, rng))
        with stopwatch(seconds, "refine"):
            refined = _proper(self.refine(scene, estimated)) if estimated.found else estimated
        if not len(found):  # an estimator that runs recipes of its own may have matched
            found = of_most(scene, refined.T)
        return Trace(scene, overlap, found, estimated, refined, seconds)


def _places(cloud: PointCloud) -> str:
    several = len(cloud.seen.places)
    if several:
        return f"{several} places, {cloud.seen.words}"
    return f"no known place ({cloud.seen.words}); if you know it, say so: a viewpoint lets free space speak"


def _proper(pose: Pose) -> Pose:
    # A stage may return float32 or a matrix that drifted; what the pipeline returns is a rotation to the last digit.
    T: NDArray[np.float64] = np.array(pose.T, dtype=np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        return Pose.unknown(0 if pose.inliers is None else len(pose.inliers))
    T[:3, :3] = project(T[:3, :3])
    T[3] = [0.0, 0.0, 0.0, 1.0]
    return replace(pose, T=T)
