# SPDX-License-Identifier: MIT
"""FCGF as a stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from hybridreg.config import limits
from hybridreg.learned.stages.dense_matching import DensePoints, match_dense
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.matches import Correspondences, Overlap
from hybridreg.scene import Scene

if TYPE_CHECKING:
    from hybridreg.learned.fcgf.network import FcgfNetwork

    pass


@dataclass(frozen=True, kw_only=True)
class Fcgf(NetworkStage):
    """Pair each voxel of the source with the target's voxel of the nearest feature (Choy et al. 2019).

    The network voxelises the clouds on its own grid, anchored at each cloud's origin; the points that are matched are
    the first of each voxel. Weights trained without rotations (KITTI's published ones) do not match rotated clouds.

    Parameters
    ----------
    min_overlap : float in [0, 1]
        Points with a lower probability of overlap are left out, unless too few would remain.
    mutual : bool
        Keep only pairs that are each other's nearest. Published results come from all of them.
    normalize : bool or None
        Whether a published checkpoint was trained with features of length one; the file does not say.
    voxel : float or None
        Edge (m) of the grid that a published checkpoint was trained with, see `FcgfNetwork.load_official`.
    """

    min_overlap: float = 0.5
    mutual: bool = False
    normalize: bool | None = None
    voxel: float | None = None

    kind: ClassVar[str] = "fcgf"
    shipped: ClassVar[str] = "fcgf-small"
    gives: ClassVar[frozenset[str]] = frozenset({"matches"})
    parts: ClassVar[frozenset[str]] = frozenset({"encoder", "decoder"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.min_overlap <= 1.0:
            raise ValueError(f"min_overlap={self.min_overlap} must lie in [0, 1]")
        limits.positive(self, "voxel")

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        from hybridreg.learned.fcgf.batch import make_batch
        from hybridreg.learned.memory_estimate import require_bytes
        from hybridreg.learned.stages.network_grid import note_grid
        from hybridreg.learned.stages.tensor_values import array

        network: FcgfNetwork = self.network()
        voxel = network.config.voxel
        self.note_random(scene)
        note_grid(scene, voxel)
        clouds = (scene.pair.target.points, scene.pair.source.points)
        cure = f"use weights with a voxel larger than {voxel:g} m, or crop the clouds"
        with self.inference():
            batch = make_batch(*clouds, network.config, device=self.device)
            lengths = (len(batch.target.points), len(batch.source.points))
            require_bytes(network.memory(batch), lengths, self.device, cure)
            found = network(batch)
        source = DensePoints(points=array(batch.source.points), features=array(found.source))
        target = DensePoints(points=array(batch.target.points), features=array(found.target))
        return match_dense(
            scene, overlap, source, target, min_overlap=self.min_overlap, mutual=self.mutual, spacing=voxel
        )

    def told(self) -> tuple[tuple[str, Any], ...]:
        """What a published checkpoint does not contain, as arguments of `FcgfNetwork.load_official`."""
        return (("normalize", self.normalize), ("voxel", self.voxel))
