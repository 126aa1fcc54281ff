# SPDX-License-Identifier: MIT
"""The common part of VGAM and GeoTransformer as matchers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.matches import Correspondences, Overlap
from hybridreg.runtime.threads import single
from hybridreg.scene import Scene

if TYPE_CHECKING:
    from hybridreg.learned.cross3dreg.network import RegistrationNetwork
    from hybridreg.learned.matching.point_matching import PointMatches


@dataclass(frozen=True, kw_only=True)
class NetworkMatcher(NetworkStage):
    """Match superpoints, then the points around them.

    Parameters
    ----------
    min_overlap : float in [0, 1] or None
        Superpoints with a lower probability of overlap are left out, unless too few would remain. None takes
        the threshold that the network was trained with.
    filtered : bool
        Leave out matches inconsistent with the others, where the network's configuration has a distance for that
        (`MatchingConfig.consistency`). Otherwise the matches depend on the features alone.
    """

    min_overlap: float | None = None
    filtered: bool = True

    gives: ClassVar[frozenset[str]] = frozenset({"matches", "group"})
    parts: ClassVar[frozenset[str]] = frozenset({"backbone", "transformer"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.min_overlap is not None and not 0.0 <= self.min_overlap <= 1.0:
            raise ValueError(f"min_overlap={self.min_overlap} must lie in [0, 1]")

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        import torch

        from hybridreg.learned.stages.encoding import encode
        from hybridreg.learned.stages.kept_superpoints import keep

        network: RegistrationNetwork = self.network()
        encoding = encode(scene, self)
        with single(), torch.inference_mode():
            kept = keep(scene, overlap, encoding, network.config, self.min_overlap)
            features = network.attend(encoding, kept)
            _, matches = network.match(encoding, kept, features, filtered=self.filtered)
        return _correspondences(matches, network)


def _correspondences(matches: PointMatches, network: RegistrationNetwork) -> Correspondences:
    from hybridreg.learned.stages.tensor_values import array

    return Correspondences(
        source=array(matches.source),
        target=array(matches.target),
        weight=array(matches.weight),
        group=matches.group.cpu().numpy(),
        spacing=network.config.backbone.fine_voxel,
    )
