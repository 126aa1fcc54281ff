# SPDX-License-Identifier: MIT
"""Dense InfoNCE at the fine stage: each point must find its true correspondence among all points (docs/methods.md
10.4)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

_FAR = -1e9


@dataclass(frozen=True, kw_only=True)
class InfoNceConfig:
    """Contrastive warm-up of the backbone. Lengths count in voxels of the network's first stage."""

    anchors: int = 384
    partner: float = 2.0  # a point corresponds to one nearer than this: the spacing of the fine points
    exclusion: float = 3.0  # other points nearer than this to the true correspondence are not negatives
    temperature: float = 0.07
    symmetric: bool = True


@dataclass(frozen=True)
class InfoNce:
    """The loss, and how many anchors already find the vicinity of their correspondence."""

    loss: Tensor
    hits: Tensor  # share of anchors whose best point lies within the exclusion radius of the true correspondence


def infonce(
    anchors: Tensor,
    candidates: Tensor,
    points: Tensor,
    partner: Tensor,
    config: InfoNceConfig,
    voxel: float,
    generator: torch.Generator,
) -> InfoNce:
    """Cross-entropy of finding each anchor's true correspondence among all candidates.

    Parameters
    ----------
    anchors, candidates
        (n, d), (m, d) fine features of the two clouds, of any length: they are normalised here only, as the
        point matcher works on features that are not.
    points
        (m, 3) the candidates' positions, metres.
    partner
        (n,) int64: the candidate nearest under the true pose, or -1.
    voxel
        Edge of the first stage's voxel, metres.
    generator
        Draws at most ``config.anchors`` anchors.

    Returns
    -------
    InfoNce
        A loss of 0 that keeps the graph where no anchor has a correspondence.
    """
    usable = (partner >= 0).nonzero()[:, 0]
    drawn = torch.randperm(len(usable), generator=generator)[: config.anchors].to(partner.device)
    chosen = usable[drawn]
    if len(chosen) == 0:
        return InfoNce((anchors.sum() + candidates.sum()) * 0.0, anchors.new_zeros(()))
    true = partner[chosen]
    scores = F.normalize(anchors[chosen], dim=1) @ F.normalize(candidates, dim=1).t() / config.temperature
    near = torch.cdist(points[true], points) < config.exclusion * voxel
    hits = near.gather(1, scores.detach().argmax(1, keepdim=True)).float().mean()
    near.scatter_(1, true[:, None], False)
    return InfoNce(F.cross_entropy(scores.masked_fill(near, _FAR), true), hits)
