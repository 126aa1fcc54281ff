# SPDX-License-Identifier: MIT
"""Mutual nearest neighbours of learned point features."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from hybridreg.learned.stages.dense_matching import DensePoints, match_dense, unit
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.matches import Correspondences, Overlap
from hybridreg.scene import Scene


@dataclass(frozen=True, kw_only=True)
class DenseFeatures(NetworkStage):
    """Match fine points whose features are mutual nearest neighbours (as in FCGF, Choy et al. 2019).

    Without a transformer: a backbone from the contrastive warm-up (docs/methods.md 10.4) suffices, and any estimator
    can use its matches. The weight of a match is the cosine of its features, at least 0.

    Parameters
    ----------
    min_overlap : float in [0, 1]
        Points with a lower probability of overlap are left out, unless too few would remain.
    """

    min_overlap: float = 0.5

    gives: ClassVar[frozenset[str]] = frozenset({"matches"})
    parts: ClassVar[frozenset[str]] = frozenset({"backbone"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.min_overlap <= 1.0:
            raise ValueError(f"min_overlap={self.min_overlap} must lie in [0, 1]")

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        from hybridreg.learned.stages.encoding import encode
        from hybridreg.learned.stages.tensor_values import array

        encoding = encode(scene, self)
        source, target = (
            DensePoints(points=array(cloud.points), features=unit(array(cloud.point_features)))
            for cloud in (encoding.source, encoding.target)
        )
        return match_dense(
            scene,
            overlap,
            source,
            target,
            min_overlap=self.min_overlap,
            mutual=True,
            spacing=self.network().config.backbone.fine_voxel,
        )
