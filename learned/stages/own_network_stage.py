# SPDX-License-Identifier: MIT
"""What the stages of networks beside today's have in common: they find theirs through `NETWORK`."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from hybridreg.learned.stages.network_stage import NetworkStage

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from typing_extensions import Self

    from hybridreg.learned.stages.networks import NetworkName
    from hybridreg.scene import Scene

# Spacings that differ by less are one; beyond the second factor the scene itself may be of another size.
_SAME, _ANOTHER_SCALE = 0.01, 2.0


@dataclass(frozen=True, kw_only=True)
class OwnNetworkStage(NetworkStage):
    """A stage whose network is an `OwnNetwork`, with ``weights``, ``size``, ``device``, ``untrained`` as all have."""

    NETWORK: ClassVar[str]  # "module:Class"
    image: ClassVar[bool] = False

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

    def save_pretrained(self, folder: str | os.PathLike[str]) -> None:
        """Write the network's weights and configuration into a folder."""
        self.network().save_pretrained(folder)  # type: ignore[operator]

    def network_name(self) -> NetworkName:
        """What tells this stage's network from others."""
        from hybridreg.learned.stages.networks import NetworkName

        return NetworkName(self.weights, self.size, self.device, False, self.NETWORK)

    def note_random(self, scene: Scene) -> None:
        """Say so where the weights are random."""
        if self.random_parts():
            scene.note(f"{type(self).__name__} ran with random weights (untrained=True)")


def on_grid(scene: Scene, voxel: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points of target and source, (M, 3) and (N, 3), at the spacing that a network was trained with.

    Levels of that spacing are taken as they are; otherwise the clouds go on a grid of the network's own, and a note
    says so.
    """
    import math

    from hybridreg.classical.voxel import voxel_centroids

    levels = (scene.target, scene.source)
    if all(math.isclose(level.spacing, voxel, rel_tol=_SAME) for level in levels):
        return scene.target.points, scene.source.points
    text = (
        f"the network was trained with a voxel of {voxel:.3g} m and put the clouds on a grid of its own; the other "
        f"stages work at {scene.spacing:.3g} m"
    )
    if max(scene.spacing / voxel, voxel / scene.spacing) > _ANOTHER_SCALE:
        text = f"{text}: is the scene of the size that the network was trained for?"
    scene.note(text)
    target, source = (
        voxel_centroids(cloud.points, voxel) for cloud in (scene.pair.target, scene.pair.source)
    )
    return target, source
