# SPDX-License-Identifier: MIT
"""The rigid motion that fits matches best in the least-squares sense."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.geometry.kabsch import kabsch
from hybridreg.matches import Correspondences, Pose
from hybridreg.scene import Scene
from hybridreg.stage import Stage

Array = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class WeightedSvd(Stage):
    """The weighted least-squares fit to all matches, without outlier rejection.

    Parameters
    ----------
    max_distance : float or None
        Metres; matches nearer than this under the pose are reported as inliers. None takes 1.5 times the
        spacing of the matches, or of the scene where they have none.
    """

    max_distance: float | None = None

    needs: ClassVar[frozenset[str]] = frozenset({"matches"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.max_distance is not None and not self.max_distance > 0.0:
            raise ValueError(f"max_distance={self.max_distance} must be a positive length in metres")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        T, status = kabsch(matches.source, matches.target, matches.weight)
        if status in ("few", "nan"):
            return Pose.unknown(len(matches))
        if status == "degenerate":
            scene.note("the matches lie on one line or in one place: the rotation about it is arbitrary")
        within = self.max_distance or 1.5 * (matches.spacing or scene.spacing)
        return Pose(T, inliers=np.linalg.norm(se3.apply(T, matches.source) - matches.target, axis=1) < within)
