# SPDX-License-Identifier: MIT
"""Mutual nearest neighbours of learned point features."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.nearest import nearest
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.matches import Correspondences, Overlap
from hybridreg.scene import Scene

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

# An overlap that leaves fewer points than this is taken to be wrong, and ignored.
_FEWEST = 100


@dataclass(frozen=True, kw_only=True)
class DenseFeatures(NetworkStage):
    """Pair the fine points whose features are each other's nearest, as FCGF does (Choy et al. 2019).

    No transformer takes part: a backbone that the contrastive warm-up has trained (specification 10.1) is enough,
    and any estimator can go on from its matches. The weight of a match is the cosine of its features, at least 0.

    Parameters
    ----------
    min_overlap : float in [0, 1]
        Points with a lower probability of overlap are left out, unless too few would remain.
    """

    min_overlap: float = 0.5

    image: ClassVar[bool] = False
    gives: ClassVar[frozenset[str]] = frozenset({"matches"})
    parts: ClassVar[frozenset[str]] = frozenset({"backbone"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.min_overlap <= 1.0:
            raise ValueError(f"min_overlap={self.min_overlap} must lie in [0, 1]")

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        from hybridreg.learned.stages.arrays import array
        from hybridreg.learned.stages.encoding import encode

        encoding = encode(scene, self)
        clouds = (encoding.source, encoding.target)
        points = [array(cloud.points) for cloud in clouds]
        features = [_unit(array(cloud.point_features)) for cloud in clouds]
        levels = ((scene.source, overlap.source), (scene.target, overlap.target))
        rows = [
            self._rows(at, level.points, probability)
            for at, (level, probability) in zip(points, levels, strict=True)
        ]
        found = nearest(features[0][rows[0]], features[1][rows[1]])
        source, target = rows[0][found.mutual], rows[1][found.row[found.mutual]]
        return Correspondences(
            source=points[0][source],
            target=points[1][target],
            weight=np.maximum(np.sum(features[0][source] * features[1][target], axis=1), 0.0),
            spacing=self.network().config.backbone.fine_voxel,
        )

    def _rows(self, points: Array, level: Array, probability: Array) -> Indices:
        from hybridreg.learned.stages.spreading import gather

        rows = np.flatnonzero(gather(probability, level, points) > self.min_overlap)
        return rows if len(rows) >= min(_FEWEST, len(points)) else np.arange(len(points))


def _unit(features: Array) -> Array:
    return features / np.maximum(np.linalg.norm(features, axis=1, keepdims=True), 1e-12)
