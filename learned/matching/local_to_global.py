# SPDX-License-Identifier: MIT
"""Local-to-global registration: every patch pair proposes a pose, all correspondences vote (docs/methods.md 9.2)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.config import LgrConfig
from hybridreg.learned.matching.procrustes import apply_transform, weighted_procrustes

_CHUNK_VOTES = 2**22


@dataclass(frozen=True)
class LgrEstimate:
    """A pose and how it was found."""

    transform: Tensor  # (4, 4): T_target_source
    inliers: Tensor  # (C,) bool: within the acceptance radius of the final pose
    hypotheses: int  # groups that proposed a pose; 0 means that the start was a fit to all matches
    proposals: Tensor  # (g, 4, 4): proposals of all groups, most votes first


def local_to_global(
    target: Tensor, source: Tensor, weight: Tensor, group: Tensor, config: LgrConfig | None = None
) -> LgrEstimate:
    """Estimate the pose from grouped correspondences; deterministic.

    Parameters
    ----------
    target, source
        (C, 3) metres; the computation stays in their float type, so that float32 agrees with the published
        networks and float64 loses nothing.
    weight
        (C,) confidences.
    group
        (C,) int64; any labels in any order. Groups of fewer than ``min_group`` propose nothing but vote.
    config
        Radius, smallest group, steps, limit on voters.

    Raises
    ------
    ValueError
        Arrays of different lengths, or no correspondence at all.
    """
    config = config or LgrConfig()
    counts = {len(target), len(source), len(weight), len(group)}
    if counts == {0} or len(counts) > 1:
        raise ValueError(f"LGR needs arrays of one length above 0, got lengths {sorted(counts)}")
    proposals = _propose(target, source, weight, group, config.min_group)
    if len(proposals):
        votes = _vote(proposals, target, source, weight, config)
        order = votes.argsort(descending=True, stable=True)
        start = proposals[order[0]]
    else:
        order = torch.zeros(0, dtype=torch.int64, device=target.device)
        start = weighted_procrustes(source, target, weight)
    transform = start
    for _ in range(config.steps):
        inliers = _inliers(transform, target, source, config.acceptance_radius)
        if not bool(inliers.any()):  # a fit to nothing would be the identity
            break
        transform = weighted_procrustes(source, target, weight * inliers)
    inliers = _inliers(transform, target, source, config.acceptance_radius)
    return LgrEstimate(transform, inliers, len(proposals), proposals[order])


def _propose(target: Tensor, source: Tensor, weight: Tensor, group: Tensor, min_group: int) -> Tensor:
    _, group, counts = torch.unique(group, return_inverse=True, return_counts=True)
    order = group.argsort(stable=True)
    starts = counts.cumsum(0) - counts
    large = (counts >= min_group).nonzero()[:, 0]
    if len(large) == 0:
        return target.new_zeros(0, 4, 4)
    slots = torch.arange(int(counts[large].max()), device=target.device)
    valid = slots[None] < counts[large, None]
    index = order[(starts[large, None] + slots[None]).clamp_max(len(order) - 1)]
    return weighted_procrustes(source[index], target[index], weight[index] * valid)


def _vote(proposals: Tensor, target: Tensor, source: Tensor, weight: Tensor, config: LgrConfig) -> Tensor:
    if config.max_votes is not None and len(weight) > config.max_votes:
        best = weight.topk(config.max_votes).indices
        target, source = target[best], source[best]
    size = max(1, _CHUNK_VOTES // len(target))
    blocks = [
        _inliers(block, target, source, config.acceptance_radius).sum(-1) for block in proposals.split(size)
    ]
    return torch.cat(blocks)


def _inliers(transform: Tensor, target: Tensor, source: Tensor, radius: float) -> Tensor:
    return (apply_transform(source, transform) - target).norm(dim=-1) < radius
