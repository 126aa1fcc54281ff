# SPDX-License-Identifier: MIT
"""The fine points of the superpoints that a mask left, and the matches between those."""

from __future__ import annotations

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.encodings import CloudEncoding, Encoding
from hybridreg.learned.cross3dreg.superpoint_mask import Kept
from hybridreg.learned.matching.point_matching import PointMatches
from hybridreg.learned.matching.point_similarity import Voters
from hybridreg.learned.pyramid.patches import Patches


def voters(cloud: CloudEncoding, kept: Kept) -> Voters:
    """The fine points of the kept superpoints, which may vote."""
    place = torch.full((len(cloud.nodes),), -1, dtype=torch.int64, device=cloud.nodes.device)
    place[kept.index] = torch.arange(len(kept.index), device=place.device)
    return Voters(cloud.point_features, place[cloud.patches.owner], len(kept.index))


def owning(patches: Patches, kept: Kept) -> Tensor:
    """Which of the kept superpoints own fine points, as places among them (k,)."""
    return patches.occupied[kept.index].nonzero()[:, 0]


def believed(
    encoding: Encoding, kept: tuple[Kept, Kept], matches: PointMatches, doubted: float
) -> PointMatches:
    """The matches without the share ``doubted`` whose ends the mask believes least to lie in the overlap."""
    target, source = kept[0].probability, kept[1].probability
    if doubted == 0.0 or len(matches) == 0 or target is None or source is None:
        return matches
    owners = (encoding.target.patches.owner, encoding.source.patches.owner)
    both = target[owners[0][matches.target_index]] * source[owners[1][matches.source_index]]
    return matches.only(both >= both.quantile(doubted))
