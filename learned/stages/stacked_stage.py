# SPDX-License-Identifier: MIT
"""The common part of the stages of Predator and CoFiNet, whose networks take both clouds stacked, on their own grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from hybridreg.learned.stages.network_stage import NetworkStage

if TYPE_CHECKING:
    from hybridreg.learned.cross3dreg.batch import Batch
    from hybridreg.scene import Scene


@dataclass(frozen=True, kw_only=True)
class StackedStage(NetworkStage):
    """A stage of a network that takes a `Batch`, with ``weights``, ``size``, ``device``, ``untrained`` like all
    others."""

    parts: ClassVar[frozenset[str]] = frozenset({"encoder"})

    def batch(self, scene: Scene) -> Batch:
        """The network's input for the pair; what would not fit into memory is refused."""
        from hybridreg.learned.cross3dreg.batch import make_batch
        from hybridreg.learned.memory_estimate import require_bytes
        from hybridreg.learned.stages.network_grid import note_grid

        network: Any = self.network()
        voxel = network.config.backbone.voxel
        # Levels on the network's grid are used directly; otherwise it makes its own from the clouds.
        ready = note_grid(scene, voxel)
        source, target = (scene.source, scene.target) if ready else (scene.pair.source, scene.pair.target)
        batch = make_batch(
            target.points, source.points, network.config, subsample=not ready, device=self.device
        )
        cure = f"use weights with a voxel larger than {voxel:g} m, or crop the clouds"
        require_bytes(network.memory(batch), batch.pyramid.lengths[0], self.device, cure)
        return batch
