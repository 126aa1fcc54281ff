# SPDX-License-Identifier: MIT
"""What the stages of Predator and CoFiNet have in common: their network looks at both clouds stacked, on its grid."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from hybridreg.learned.stages.network_stage import NetworkStage

if TYPE_CHECKING:
    from typing_extensions import Self

    from hybridreg.learned.batch import Batch
    from hybridreg.learned.stages.networks import NetworkName
    from hybridreg.scene import Scene


@dataclass(frozen=True, kw_only=True)
class StackedStage(NetworkStage):
    """A stage of the network that ``kind`` names, with ``weights``, ``size``, ``device``, ``untrained`` as all have.

    ``weights`` may be a folder of that network or one of its published checkpoints (``.pth``); ``size`` then says
    which configuration a checkpoint is of, where its kernel points do not.
    """

    kind: ClassVar[str]
    image: ClassVar[bool] = False
    parts: ClassVar[frozenset[str]] = frozenset({"encoder"})

    @classmethod
    def load_official(cls, path: str | os.PathLike[str], **fields: Any) -> Self:
        """Stage of a checkpoint that the authors published, read at once.

        Raises
        ------
        FileNotFoundError
            No such file.
        ValueError
            Not a checkpoint of this network: the wrong tensor is named.
        """
        return cls.from_pretrained(path, **fields)

    def network_name(self) -> NetworkName:
        """What tells this stage's network from others; stages of one name share one pass over a pair."""
        from hybridreg.learned.stages.networks import NetworkName, is_checkpoint

        if self.weights is not None and is_checkpoint(self.weights):
            return NetworkName(self.weights, None, self.device, False, self.kind, (("config", self.size),))
        return NetworkName(self.weights, self.size, self.device, False, self.kind)

    def batch(self, scene: Scene) -> Batch:
        """The pair as the network sees it; what would not fit into memory is refused."""
        from hybridreg.learned.batch import make_batch
        from hybridreg.learned.memory import require_bytes
        from hybridreg.learned.stages.encoding import note_grid

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
