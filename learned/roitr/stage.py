# SPDX-License-Identifier: MIT
"""RoITr as a matcher."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.learned.stages.network_grid import on_grid
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.matches import Correspondences, Overlap
from hybridreg.scene import Level, Scene

if TYPE_CHECKING:
    from torch import Tensor

    from hybridreg.learned.cross3dreg.encodings import CloudEncoding
    from hybridreg.learned.roitr.network import RoitrNetwork

Array = NDArray[np.float64]

# A mask that leaves fewer superpoints than this is considered wrong, and ignored.
_FEWEST = 4


@dataclass(frozen=True, kw_only=True)
class Roitr(NetworkStage):
    """Superpoints and points matched by rotation-invariant features (Yu et al., CVPR 2023).

    Needs oriented normals: they are estimated from 33 neighbours and oriented towards the frame's origin for the
    published weights, as these expect, and for others towards each cloud's viewpoint (`RoitrConfig.facing`).

    Parameters
    ----------
    min_overlap : float in [0, 1]
        Superpoints with a lower probability of overlap are not matched, unless too few would remain.
    """

    min_overlap: float = 0.5

    kind: ClassVar[str] = "roitr"
    shipped: ClassVar[str] = "roitr-small"
    gives: ClassVar[frozenset[str]] = frozenset({"matches", "group"})
    parts: ClassVar[frozenset[str]] = frozenset({"backbone", "transformer"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.min_overlap <= 1.0:
            raise ValueError(f"min_overlap={self.min_overlap} must lie in [0, 1]")

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        from hybridreg.learned.memory_estimate import require_bytes
        from hybridreg.learned.roitr.batch import make_batch
        from hybridreg.learned.stages.tensor_values import array

        network: RoitrNetwork = self.network()
        self.note_random(scene)
        config = network.config
        clouds = [
            _thinned(scene, name, points, config.max_points)
            for name, points in zip(("target", "source"), on_grid(scene, config.voxel), strict=True)
        ]
        viewpoints = (scene.target.viewpoint, scene.source.viewpoint)
        cure = f"use weights with a voxel larger than {config.voxel:g} m, or crop the clouds"
        with self.inference():
            batch = make_batch(clouds[0], clouds[1], config, viewpoints=viewpoints, device=self.device)
            require_bytes(network.memory(batch), (len(clouds[0]), len(clouds[1])), self.device, cure)
            target, source = network.encode(batch)
            kept = (
                self._kept(overlap.target, scene.target, target),
                self._kept(overlap.source, scene.source, source),
            )
            matches = network.match_points(target, source, network.match_superpoints(target, source, kept))
        return Correspondences(
            source=array(matches.source),
            target=array(matches.target),
            weight=array(matches.weight),
            group=matches.group.cpu().numpy(),
            spacing=config.voxel,
        )

    def _kept(self, probability: Array, level: Level, cloud: CloudEncoding) -> Tensor:
        import torch

        from hybridreg.learned.stages.spreading import gather
        from hybridreg.learned.stages.tensor_values import array

        mask = gather(probability, level.points, array(cloud.nodes)) > self.min_overlap
        kept = torch.from_numpy(mask).to(cloud.nodes.device) & cloud.patches.occupied
        return kept if int(kept.sum()) >= _FEWEST else cloud.patches.occupied


def _thinned(scene: Scene, name: str, points: Array, most: int) -> Array:
    if len(points) <= most:
        return points
    scene.note(f"{name}: RoITr used {most} of {len(points)} points, drawn at random (max_points)")
    return points[np.sort(np.random.default_rng(0).choice(len(points), most, replace=False))]
