# SPDX-License-Identifier: MIT
"""A registration pipeline: five slots, then the verdict."""

from __future__ import annotations

import os
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg import fitting, frames, presets, spec
from hybridreg.cloud import PointCloud
from hybridreg.geometry.se3 import project
from hybridreg.io import shipped_weights
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.pair import Pair
from hybridreg.prior.prior import Prior
from hybridreg.resolution import tolerance
from hybridreg.result import RegistrationResult
from hybridreg.runtime import optional_packages
from hybridreg.runtime.resources import Clock, peak_memory_mb, reset_peak_memory
from hybridreg.runtime.threads import one_blas
from hybridreg.scene import Scene
from hybridreg.slots import SLOTS, check_matches, checked, in_order
from hybridreg.stage import Stage, own_changes, same


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
    prior : Prior, mapping of its fields, or None
        What is known of the pose beforehand: `hybridreg.prior.prior.Prior`.

    Raises
    ------
    KeyError
        A name that nobody registered.
    ValueError
        Stages that do not fit together; the message names one that would.
    """

    # What it says stands in `downsample`, so that a pipeline equals the one that its file gives.
    voxel: float | None = field(default=None, compare=False)
    downsample: Any = "voxel"
    overlap: Any = "none"
    match: Any = "fpfh"
    estimate: Any = "ransac"
    refine: Any = "gicp"
    prior: Any = None
    _given_downsample: ClassVar[Any]

    def __post_init__(self) -> None:
        for slot in SLOTS:
            given = getattr(self, slot)
            if isinstance(given, (str, Mapping)):
                object.__setattr__(self, slot, spec.from_table(given, slot))
        downsample = fitting.with_voxel(self.downsample, self.voxel)
        # For `get_params`: beside a voxel the stage has none of its own, so that the voxel alone can be changed.
        given = self.downsample if self.voxel is None else fitting.without_voxel(self.downsample)
        object.__setattr__(self, "_given_downsample", given)
        object.__setattr__(self, "downsample", downsample)
        fitting.check(self)
        if self.prior is not None:
            object.__setattr__(self, "prior", Prior.of(self.prior))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Pipeline):
            return NotImplemented
        return all(same(getattr(self, name), getattr(other, name)) for name in (*SLOTS, "prior"))

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
        """Write the pipeline as TOML, whole or not at all.

        Raises
        ------
        ValueError
            A stage holds what no file can hold, such as a network.
        """
        presets.write(path, self.to_spec(for_file=True))

    def to_spec(self, *, for_file: bool = False) -> dict[str, Any]:
        """One table a slot, and one of the prior where there is one; see `hybridreg.spec.to_table`."""
        slots = {slot: spec.to_table(getattr(self, slot), slot, for_file=for_file) for slot in SLOTS}
        return slots if self.prior is None else {**slots, "prior": self.prior.to_table()}

    def swap(self, **stages: Any) -> Pipeline:
        """A copy with some slots filled anew: `pipe.swap(estimate="ransac")`.

        An estimate stage that is kept and named the weights of the match stage names those of the new one.
        """
        unknown = set(stages) - {*SLOTS, "voxel", "prior"}
        if unknown:
            raise TypeError(
                f"no slot is called {', '.join(sorted(unknown))}; the slots are {', '.join(SLOTS)}"
            )
        if "match" in stages and "estimate" not in stages:
            given = stages["match"]
            stages["match"] = spec.from_table(given, "match") if isinstance(given, (str, Mapping)) else given
            stages["estimate"] = fitting.following(self.match, stages["match"], self.estimate)
        if "downsample" in stages:
            stages.setdefault("voxel", None)
        elif "voxel" in stages:
            stages["downsample"] = fitting.ready_for_voxel(self.downsample, stages["voxel"])
        return type(self)(**{**self.get_params(deep=False), **stages})

    def replace(self, **changes: Any) -> Pipeline:
        """As `swap`; `slot__field` reaches into a stage: `pipe.replace(match="fpfh", match__radius=2.5)`."""
        return self.swap(**own_changes(self, changes))

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Slots by name, as a new pipeline takes them; with `deep`, also the stages' fields as `slot__field`."""
        return {**super().get_params(deep), "downsample": self._given_downsample}

    def __call__(
        self,
        source: Any,
        target: Any,
        image: Any = None,
        *,
        seed: int = 0,
        nonfinite: Literal["raise", "drop"] = "raise",
    ) -> RegistrationResult:
        """Align two clouds; takes anything that `PointCloud.of` does, and `nonfinite` as it does."""
        return self.run(Pair.of(source, target, image, nonfinite=nonfinite), seed=seed)

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
            For clouds that no pose can be computed from, naming cloud, number and cure; for a negative seed.
        ImportError
            A stage needs a package that is not installed; the message names the extra that brings it.
        """
        reset_peak_memory()
        with optional_packages.told("a stage of this pipeline"), one_blas():
            trace = self.trace(pair, seed=seed, matches=matches)
            result = self.conclude(trace, seed=seed)
            trace.scene.release()
            return result

    def conclude(self, trace: Trace, *, seed: int = 0) -> RegistrationResult:
        """The verdict on a traced run, and its result in the user's coordinates."""
        pair = trace.scene.pair
        with trace.scene.clock.phase("verdict"):
            from hybridreg.verdict import judge, of_scale

            judgement = judge(trace.scene, trace.refined, trace.matches)
        return RegistrationResult(
            scale=1.0 if pair.placed is None else pair.placed.scale,
            scale_verdict=of_scale(judgement, pair.placed.margin)
            if pair.placed and self.prior.scale
            else None,
            transformation=frames.raise_found(trace.refined, pair),
            rivals=np.array([frames.raise_pose(T, pair) for T in judgement.rivals]).reshape(-1, 4, 4),
            matches=frames.raise_matches(trace.matches, pair),
            verdict=judgement.verdict,
            confidence=judgement.confidence,
            reasons=judgement.reasons,
            overlay=judgement.overlay,
            information=frames.raise_information(judgement.information, pair),
            centre=frames.raise_target(judgement.centre[None], pair)[0],
            evidence=judgement.evidence,
            notes=tuple(trace.scene.notes),
            seconds={step: trace.seconds[step] for step in sorted(trace.seconds, key=in_order)},
            peak_memory_mb=peak_memory_mb(),
            seed=seed,
            spec=self.to_spec(),
            tolerance=tolerance(pair.source, pair.target),
            entries=trace.estimated.entries,
            found=trace.refined.found,
        )

    def trace(self, pair: Pair, *, seed: int = 0, matches: Any = None) -> Trace:
        """Run the stages and keep what each of them produced."""
        from hybridreg.evidence.match_agreement import of_most

        clock = Clock()
        fitting.check_image(self, pair)
        if self.prior is not None:
            if matches is not None and self.prior.crop and not isinstance(matches, Correspondences):
                raise ValueError(
                    "matches: rows of points do not go with crop=...; give Correspondences instead"
                )
            with clock.phase("prior"):
                pair = self.prior.applied(pair)
        fitting.check_seed(seed)
        rng = np.random.default_rng([seed, zlib.crc32(pair.id.encode())])
        with clock.phase("downsample"):
            scene = replace(checked("downsample", self.downsample, self.downsample(pair)), clock=clock)
        fitting.check_scene(scene, pair)
        for name, cloud in (("source", scene.pair.source), ("target", scene.pair.target)):
            if len(cloud.seen.places) != 1:
                scene.note(f"the {name} was seen from {_places(cloud)}")
            if cloud.dropped:
                scene.note(
                    f"{cloud.dropped} points of the {name} were missing (not finite, or at 0, 0, 0) and were dropped"
                )
        with clock.phase("overlap"):
            overlap = checked("overlap", self.overlap, self.overlap(scene), scene)
        with clock.phase("match"):
            if matches is None:
                found = scene.matched(checked("match", self.match, self.match(scene, overlap)))
            else:
                found = frames.lower_matches(matches, pair)
                check_matches(found, "matches: some were given")
                found = scene.matched(found)
        estimate = self.estimate if self.prior is None else self.prior.started(self.estimate)
        with clock.phase("estimate"):
            estimated = _proper(checked("estimate", self.estimate, estimate(scene, found, rng), scene))
            estimated = _within(scene, estimated)
        with clock.phase("refine"):
            refined = estimated
            if estimated.found:
                refined = _proper(checked("refine", self.refine, self.refine(scene, estimated), scene))
                refined = _within(scene, refined)
        if not len(found):  # an estimator that runs recipes of its own may have matched
            found = of_most(scene, refined.T)
        return Trace(scene, overlap, found, estimated, refined, clock.seconds)


def _places(cloud: PointCloud) -> str:
    several = len(cloud.seen.places)
    if several:
        return f"{several} places, {cloud.seen.words}"
    return f"no known place ({cloud.seen.words}); if you know it, say so: a viewpoint lets free space speak"


def _within(scene: Scene, pose: Pose) -> Pose:
    """The pose, or the best of its rivals that the pair's bounds allow; where none is, no pose."""
    bounds = scene.pair.bounds
    if bounds is None or not pose.found:
        return pose
    allowed = [T for T in (pose.T, *pose.rivals) if bounds.allow(T)]
    if not allowed:
        scene.explanations.append(f"the best pose lies {bounds.against(pose.T)}")
        return Pose.unknown(0 if pose.inliers is None else len(pose.inliers))
    if bounds.allow(pose.T):
        return replace(pose, rivals=np.array(allowed[1:]).reshape(-1, 4, 4))
    return Pose.ranked(allowed)


def _proper(pose: Pose) -> Pose:
    # A stage may return float32 or a matrix that drifted; what the pipeline returns is a rotation to the last digit.
    T: NDArray[np.float64] = np.array(pose.T, dtype=np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        return Pose.unknown(0 if pose.inliers is None else len(pose.inliers))
    T[:3, :3] = project(T[:3, :3])
    T[3] = [0.0, 0.0, 0.0, 1.0]
    return replace(pose, T=T)
