# SPDX-License-Identifier: MIT
"""Predator as an overlap stage and as a matcher."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.learned.stages.stacked_stage import StackedStage
from hybridreg.matches import Correspondences, Overlap
from hybridreg.scene import Level, Scene

if TYPE_CHECKING:
    from hybridreg.learned.predator.network import PredatorCloud, PredatorOutput

Array = NDArray[np.float64]

# An overlap mask that leaves fewer points than this is considered wrong, and ignored.
_FEWEST = 100


@dataclass(frozen=True, kw_only=True)
class _PredatorStage(StackedStage):
    kind: ClassVar[str] = "predator"
    shipped: ClassVar[str] = "predator-small"

    def output(self, scene: Scene) -> PredatorOutput:
        """The network's output for a pair: computed once a run for all stages of the same network."""
        return self.once(scene, lambda: self._run(scene))

    def _run(self, scene: Scene) -> PredatorOutput:
        with self.inference():
            output: PredatorOutput = self.network()(self.batch(scene))
        return output


@dataclass(frozen=True, kw_only=True)
class PredatorOverlap(_PredatorStage):
    """Overlap probabilities of the points by Predator (Huang et al. 2021).

    Each point takes the score of the nearest point on the network's grid. A matcher of the same weights shares the
    computation.
    """

    def __call__(self, scene: Scene) -> Overlap:
        from hybridreg.learned.stages.spreading import spread
        from hybridreg.learned.stages.tensor_values import array

        output = self.output(scene)
        source, target = (
            spread(array(cloud.overlap), array(cloud.points), level.points)
            for cloud, level in ((output.source, scene.source), (output.target, scene.target))
        )
        return Overlap(source, target)


@dataclass(frozen=True, kw_only=True)
class Predator(_PredatorStage):
    """Salient points in the overlap, matched by nearest features (Huang et al. 2021).

    Points are drawn by the product of overlap and saliency, without replacement, then each of the source's is matched
    to the nearest of the target's. An overlap stage before it replaces the network's own overlap scores.

    Parameters
    ----------
    points : int
        At most this many are drawn per cloud; 5000 as published.
    mutual : bool
        Keep only pairs that are each other's nearest. Published results come from all of them.
    seed : int
        Of the random sampling.
    """

    points: int = 5000
    mutual: bool = False
    seed: int = 0

    gives: ClassVar[frozenset[str]] = frozenset({"matches"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.points < 1:
            raise ValueError(f"points={self.points} must be at least 1")
        if self.seed < 0:
            raise ValueError(f"seed={self.seed} must not be negative")

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        from hybridreg.learned.stages.dense_matching import DensePoints, match_points
        from hybridreg.learned.stages.tensor_values import array

        output = self.output(scene)
        sides = (
            (output.source, scene.source, overlap.source),
            (output.target, scene.target, overlap.target),
        )
        clouds = []
        for number, (cloud, level, given) in enumerate(sides):
            rows = self._rows(cloud, level, given, number)
            clouds.append(DensePoints(points=array(cloud.points)[rows], features=array(cloud.features)[rows]))
        spacing = self.network().config.backbone.voxel
        return match_points(clouds[0], clouds[1], mutual=self.mutual, spacing=spacing)

    def _rows(self, cloud: PredatorCloud, level: Level, given: Array, number: int) -> NDArray[np.int64]:
        from hybridreg.learned.stages.drawing import draw
        from hybridreg.learned.stages.spreading import gather
        from hybridreg.learned.stages.tensor_values import array

        own, saliency, points = array(cloud.overlap), array(cloud.saliency), array(cloud.points)
        # A mask that is one everywhere has no information.
        weight = own if bool((given == 1.0).all()) else gather(given, level.points, points)
        rows = draw(weight * saliency, self.points, self.seed + number)
        if len(rows) >= min(_FEWEST, len(points), self.points):
            return rows
        # Scores of zero everywhere: all points are equally good.
        rows = draw(own * saliency, self.points, self.seed + number)
        return rows if len(rows) else draw(np.ones(len(points)), self.points, self.seed + number)
