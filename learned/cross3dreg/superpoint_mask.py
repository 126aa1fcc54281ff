# SPDX-License-Identifier: MIT
"""Which superpoints are kept for matching: the predicted mask, its fallbacks, and the limit (docs/methods.md 5.5)."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.config import OmpConfig
from hybridreg.learned.pyramid.patches import Patches

Fallback = Literal["none", "topk", "all"]
_MIN_NODES = 4


@dataclass(frozen=True)
class Kept:
    """Kept superpoints of one cloud, ascending, the fallback that chose them, and the overlap probability of all
    superpoints, where it is known."""

    index: Tensor  # (k,) int64
    fallback: Fallback = "none"
    capped: int = 0  # superpoints left out only because there were too many
    probability: Tensor | None = None  # (n,)


def keep_predicted(probability: Tensor, patches: Patches, config: OmpConfig) -> Kept:
    """Superpoints above the threshold; if too few, the most probable; if still too few, all with fine points."""
    n = len(probability)
    fallback: Fallback = "none"
    keep = probability > config.threshold
    least = min(n, max(config.min_kept, math.ceil(config.min_kept_share * n)))
    if int(keep.sum()) < least:
        fallback = "topk"
        keep = torch.zeros_like(keep)
        keep[probability.topk(least).indices] = True
    keep &= patches.occupied
    if int(keep.sum()) < _MIN_NODES:
        return Kept(patches.occupied.nonzero()[:, 0], "all")
    return Kept(keep.nonzero()[:, 0], fallback)


def keep_all(patches: Patches) -> Kept:
    """Every superpoint, as in GeoTransformer: those without fine points still take part in the attention."""
    return Kept(torch.arange(len(patches.mask), device=patches.mask.device))


def choose(patches: Patches, probability: Tensor | None, config: OmpConfig, limit: int) -> Kept:
    """Superpoints of one cloud that are kept: by their overlap probability (n,), or all where it is not known."""
    if probability is None:
        sizes = torch.bincount(patches.owner, minlength=len(patches.mask))
        return cap(keep_all(patches), sizes, limit)
    return replace(
        cap(keep_predicted(probability, patches, config), probability, limit), probability=probability
    )


def cap(kept: Kept, priority: Tensor, limit: int) -> Kept:
    """At most ``limit`` superpoints, by ``priority`` (n,): the structure embedding is n x n."""
    if len(kept.index) <= limit:
        return kept
    order = priority[kept.index].argsort(descending=True, stable=True)[:limit]
    return Kept(kept.index[order].sort().values, kept.fallback, len(kept.index) - limit)
