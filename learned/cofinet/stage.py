# SPDX-License-Identifier: MIT
"""CoFiNet as a matcher."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import NDArray

from hybridreg.learned.stages.stacked_stage import StackedStage
from hybridreg.matches import Correspondences, Overlap
from hybridreg.scene import Level, Scene

if TYPE_CHECKING:
    from torch import Tensor

    from hybridreg.learned.cofinet.network import CofinetCloud, CofinetEncoding, CofinetNetwork
    from hybridreg.learned.cofinet.selection import NodePairs

# An overlap mask that leaves fewer superpoints of a cloud than this is considered wrong, and ignored.
_FEWEST = 4


@dataclass(frozen=True, kw_only=True)
class Cofinet(StackedStage):
    """Superpoints matched by optimal transport, then the points around them (Yu et al. 2021).

    Parameters
    ----------
    min_overlap : float in [0, 1]
        Superpoints with a lower probability of overlap are left out, unless too few would remain.
    matches : int
        At most this many are returned, drawn by their confidence; 5000 as published.
    seed : int
        Of the random sampling.
    """

    min_overlap: float = 0.5
    matches: int = 5000
    seed: int = 0

    kind: ClassVar[str] = "cofinet"
    shipped: ClassVar[str] = "cofinet-small"
    gives: ClassVar[frozenset[str]] = frozenset({"matches", "group"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.min_overlap <= 1.0:
            raise ValueError(f"min_overlap={self.min_overlap} must lie in [0, 1]")
        if self.matches < 1:
            raise ValueError(f"matches={self.matches} must be at least 1")
        if self.seed < 0:
            raise ValueError(f"seed={self.seed} must not be negative")

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        from hybridreg.learned.stages.drawing import draw
        from hybridreg.learned.stages.tensor_values import array

        network: CofinetNetwork = self.network()
        encoding = self.once(scene, lambda: self._encode(scene))
        with self.inference():
            found = network.match_points(encoding, self._nodes(scene, overlap, encoding))
        rows = draw(array(found.weight), self.matches, self.seed)
        return Correspondences(
            source=array(found.source)[rows],
            target=array(found.target)[rows],
            weight=array(found.weight)[rows],
            group=found.group.cpu().numpy()[rows],
            spacing=network.config.backbone.voxel,
        )

    def _encode(self, scene: Scene) -> CofinetEncoding:
        with self.inference():
            return self.network().encode(self.batch(scene))

    def _nodes(self, scene: Scene, overlap: Overlap, encoding: CofinetEncoding) -> NodePairs:
        from hybridreg.learned.cofinet.selection import select

        config = self.network().config.selection
        probability = encoding.log_assignment[:-1, :-1].exp()
        source = self._kept(encoding.source, scene.source, overlap.source)
        target = self._kept(encoding.target, scene.target, overlap.target)
        # Below 0, so that no threshold lets the others through.
        nodes, tried = select(probability.masked_fill(~(source[:, None] & target[None]), -1.0), config)
        if tried[-1].pairs > len(nodes.source):
            scene.note(
                f"{len(nodes.source)} of {tried[-1].pairs} pairs of superpoints were matched (max_pairs)"
            )
        return nodes

    def _kept(self, cloud: CofinetCloud, level: Level, probability: NDArray[np.float64]) -> Tensor:
        import torch

        from hybridreg.learned.stages.spreading import gather
        from hybridreg.learned.stages.tensor_values import array

        kept = gather(probability, level.points, array(cloud.nodes)) > self.min_overlap
        # A mask that is one everywhere has no information, nor has one that leaves nothing.
        if bool((probability == 1.0).all()) or kept.sum() < min(_FEWEST, len(kept)):
            kept = np.ones(len(kept), dtype=bool)
        return torch.from_numpy(kept).to(cloud.nodes.device)
