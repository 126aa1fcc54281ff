# SPDX-License-Identifier: MIT
"""Controls of an ablation: a pipeline that gets the true overlap, or another image than the pair's, or none.

The true pose stays within the evaluator: `predict` gives the labelled pair to the control, which returns a pipeline
for this one pair. The stage that uses the true pose is not registered, so no pipeline file can name it.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from hybridreg.frames import lower_pose
from hybridreg.geometry import se3
from hybridreg.matches import Overlap
from hybridreg.pair import LabelledPair, Pair
from hybridreg.pipeline import Pipeline
from hybridreg.scene import Scene

Array = NDArray[np.float64]

# Appended to the name of a row that is not a method.
MARK = " †"


@dataclass(frozen=True, kw_only=True)
class Control:
    """A pipeline that is run as a control.

    Attributes
    ----------
    oracle : replace its overlap stage by the true overlap
    image : the camera image that it gets: the pair's (True), none (False), or the next pair's ("other")
    """

    pipeline: Pipeline
    oracle: bool = False
    image: bool | Literal["other"] = True

    def __post_init__(self) -> None:
        if not isinstance(self.oracle, bool):
            raise ValueError(f"oracle = {self.oracle!r}: expected true or false")
        if not (isinstance(self.image, bool) or self.image == "other"):
            raise ValueError(f"image = {self.image!r}: expected true, false or 'other'")

    def to_spec(self) -> dict[str, Any]:
        """The pipeline's tables, and what the control does to it."""
        return {**self.pipeline.to_spec(), "control": {"oracle": self.oracle, "image": self.image}}

    def told(
        self, labelled: LabelledPair, other: Callable[[], LabelledPair] | None = None
    ) -> tuple[Pipeline, Pair]:
        """The pipeline for this pair, and the pair as the pipeline may see it; `other` reads the next pair."""
        pipeline, pair = self.pipeline, labelled.pair
        if self.oracle:
            pipeline = pipeline.swap(overlap=TrueOverlap(T=lower_pose(labelled.T_target_source, pair)))
        if self.image == "other":
            assert other is not None, "a control by another pair's image needs that pair"
            pair = dataclasses.replace(pair, image=other().pair.image)
        elif not self.image:
            pair = dataclasses.replace(pair, image=None)
        return pipeline, pair


def after(pairs: Sequence[LabelledPair], index: int) -> Callable[[], LabelledPair]:
    """Reads the pair after this one, and after the last the first."""
    return lambda: pairs[(index + 1) % len(pairs)]


@dataclass(frozen=True, kw_only=True, eq=False)
class TrueOverlap:
    """The overlap under the true pose: points with a point of the other level nearby.

    Attributes
    ----------
    T : (4, 4) true pose, source to target
    """

    T: Array

    def __call__(self, scene: Scene) -> Overlap:
        scene.note("control: the overlap was taken from the ground truth, this is not a method")
        source, target = true_overlap(scene, self.T)
        return Overlap(source.astype(float), target.astype(float))


def true_overlap(scene: Scene, T: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Which points (n,) of the source's level and (m,) of the target's have one of the other within twice the
    spacing under the true pose T."""
    moved, target, radius = se3.apply(T, scene.source.points), scene.target.points, 2.0 * scene.spacing
    return near(moved, target, radius), near(target, moved, radius)


def near(points: Array, others: Array, radius: float) -> NDArray[np.bool_]:
    """Which points (n, 3) have one of the others within the radius, (n,)."""
    distance, _ = cKDTree(others).query(points, distance_upper_bound=radius)
    found: NDArray[np.bool_] = np.isfinite(distance)
    return found
