# SPDX-License-Identifier: MIT
"""What the stages of Predator and CoFiNet have in common: their network looks at both clouds stacked, on its grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from hybridreg.learned.stages.network_stage import NetworkStage

if TYPE_CHECKING:
    from hybridreg.learned.cross3dreg.batch import Batch
    from hybridreg.scene import Scene


@dataclass(frozen=True, kw_only=True)
class StackedStage(NetworkStage):
    """A stage of a network that takes a `Batch`, with ``weights``, ``size``, ``device``, ``untrained`` as all have."""

    parts: ClassVar[frozenset[str]] = frozenset({"encoder"})

    def batch(self, scene: Scene) -> Batch:
        """The pair as the network sees it; what would not fit into memory is refused."""
        from hybridreg.learned.cross3dreg.batch import make_batch
        from hybridreg.learned.memory_estimate import require_bytes
        from hybridreg.learned.stages.network_grid import note_grid

        network: Any = self.network()
        voxel = network.config.backbone.voxel
        # Levels on the network's grid are taken as they are; otherwise it makes its own from the clouds.
        ready = note_grid(scene, voxel)
        source, target = (scene.source, scene.target) if ready else (scene.pair.source, scene.pair.target)
        batch = make_batch(
            target.points, source.points, network.config, subsample=not ready, device=self.device
        )
        cure = f"use weights with a voxel larger than {voxel:g} m, or crop the clouds"
        require_bytes(network.memory(batch), batch.pyramid.lengths[0], self.device, cure)
        return batch
