# SPDX-License-Identifier: MIT
"""The common part of VGAM and GeoTransformer as matchers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal

from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.matches import Correspondences, Described, Overlap
from hybridreg.scene import Scene

if TYPE_CHECKING:
    from typing_extensions import Self

    from hybridreg.learned.cross3dreg.encodings import CloudEncoding, Encoding
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
        Leave out matches that are not unique, that the mask doubts and that do not move with the others, where the
        network's configuration asks for that. Without it the matches are what the features alone say.
    as_published : bool
        Match as arXiv 2509.06456 prints it, and GeoTransformer with it, whatever the configuration adds
        (`hybridreg.learned.cross3dreg.as_published`): no votes, no uniqueness, no filter, the mask cut at 0.5.
    similarity : "unit", "raw" or None
        Of superpoints: of their features at length one, as GeoTransformer and our training have it, or as they come, as
        the paper's equation has it. None takes what the network's configuration says.
    """

    min_overlap: float | None = None
    filtered: bool = True
    as_published: bool = False
    similarity: Literal["unit", "raw"] | None = None

    gives: ClassVar[frozenset[str]] = frozenset({"matches", "group"})
    parts: ClassVar[frozenset[str]] = frozenset({"backbone", "transformer"})

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.min_overlap is not None and not 0.0 <= self.min_overlap <= 1.0:
            raise ValueError(f"min_overlap={self.min_overlap} must lie in [0, 1]")

    def configured(self) -> RegistrationNetwork:
        """The network under the configuration that this stage matches with."""
        from dataclasses import replace

        from hybridreg.learned.cross3dreg.as_published import as_published

        network: RegistrationNetwork = self.network()
        config = as_published(network.config) if self.as_published else network.config
        if self.similarity is not None:
            config = replace(config, matching=replace(config.matching, similarity=self.similarity))
        return network.configured(config)

    def mask_threshold(self) -> float:
        """Above which probability of overlap a superpoint goes on."""
        from hybridreg.learned.cross3dreg.config import OmpConfig

        if self.min_overlap is not None:
            return self.min_overlap
        return (self.configured().config.omp or OmpConfig()).threshold

    def unfiltered(self) -> Self | None:
        """The same matching without the filters that leave matches out; None where none does."""
        from dataclasses import replace

        config = self.configured().config
        matching, doubted = config.matching, 0.0 if config.omp is None else config.omp.doubted
        active = matching.uniqueness > 0.0 or matching.consistency is not None or doubted > 0.0
        return replace(self, filtered=False) if self.filtered and active else None

    def __call__(self, scene: Scene, overlap: Overlap) -> Correspondences:
        from hybridreg.learned.stages.encoding import encode
        from hybridreg.learned.stages.kept_superpoints import keep

        network = self.configured()
        encoding = encode(scene, self)
        with self.inference():
            kept = keep(scene, overlap, encoding, network.config, self.min_overlap)
            features = network.attend(encoding, kept)
            _, matches = network.match(encoding, kept, features, filtered=self.filtered)
            return _correspondences(matches, encoding, network)


def _correspondences(
    matches: PointMatches, encoding: Encoding, network: RegistrationNetwork
) -> Correspondences:
    from hybridreg.learned.stages.tensor_values import array

    return Correspondences(
        source=array(matches.source),
        target=array(matches.target),
        weight=array(matches.weight),
        group=matches.group.cpu().numpy(),
        spacing=network.config.backbone.fine_voxel,
        described=(_described(encoding.source), _described(encoding.target)),
    )


def _described(cloud: CloudEncoding) -> Described:
    from torch.nn.functional import normalize

    from hybridreg.learned.stages.tensor_values import array

    features = normalize(cloud.point_features, dim=1).detach().float().cpu().numpy()
    return Described(array(cloud.points), features)
