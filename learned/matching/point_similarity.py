# SPDX-License-Identifier: MIT
"""Similarities of all fine points of two clouds: votes for superpoint pairs, and the uniqueness of matches.

Not in the published networks. There the superpoints' own features must find the match, which takes far more training
than fine features need: those compare a point with thousands of others in every step (docs/methods.md 10.4).
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional as F

# Values of one block of the similarity matrix: 16 MB, whatever the number of points.
_BLOCK_VALUES = 2**22
# Added to every vote: a pair without any is improbable, not impossible.
_NO_VOTE = 1e-6


@dataclass(frozen=True)
class Voters:
    """The fine points of one cloud that may vote.

    features : (N, d), of any length
    owner : (N,) int64, place among the ``size`` superpoints that take part; -1 for points of others
    """

    features: Tensor
    owner: Tensor
    size: int


@dataclass(frozen=True)
class PointSimilarity:
    """Comparison of all points of both clouds by the cosine of their features.

    votes : (m, n) logarithm of the votes for each pair of superpoints, target by source
    target, source : (N, d), (M, d) features whose products are the scores
    target_total, source_total : (N,), (M,) logarithm of the sum of a point's exponentiated scores; infinite for points
        that take no part
    """

    votes: Tensor
    target: Tensor
    source: Tensor
    target_total: Tensor
    source_total: Tensor

    def uniqueness(self, target_index: Tensor, source_index: Tensor) -> Tensor:
        """Uniqueness of matches of points (C,), (C,) among all: the product of both softmaxes, (C,)."""
        score = (self.target[target_index] * self.source[source_index]).sum(1)
        return torch.exp(2.0 * score - self.target_total[target_index] - self.source_total[source_index])


def compare_points(target: Voters, source: Voters, temperature: float) -> PointSimilarity:
    """Compare every point with every point of the other cloud.

    Each point has one vote, distributed over the other cloud's superpoints by a softmax of its best score within each
    patch. A superpoint pair gets the product of the votes of both sides.
    """
    at_target, at_source = ((voters.owner >= 0).nonzero()[:, 0] for voters in (target, source))
    features = [F.normalize(voters.features, dim=1) / temperature**0.5 for voters in (target, source)]
    f, g = features[0][at_target], features[1][at_source]
    owner_f, owner_g = target.owner[at_target], source.owner[at_source]
    lowest, least = torch.finfo(f.dtype).min, torch.finfo(f.dtype).tiny
    best_f = f.new_full((source.size, len(f)), lowest)  # of each target point within each source patch
    total_f, total_g, given_g = f.new_zeros(len(f)), [], f.new_zeros(source.size, target.size)
    # Scores are at most 1 / temperature: subtracted, no exponential overflows.
    highest = 1.0 / temperature
    for block in torch.arange(len(g), device=g.device).split(max(1, _BLOCK_VALUES // max(1, len(f)))):
        scores = g[block] @ f.t()
        row = owner_g[block][:, None].expand_as(scores)
        best_f.scatter_reduce_(0, row, scores, "amax")
        best_g = scores.new_full((len(block), target.size), lowest)
        best_g.scatter_reduce_(1, owner_f[None].expand_as(scores), scores, "amax")
        given_g.index_add_(0, owner_g[block], torch.softmax(best_g, 1))
        scores.sub_(highest).exp_()
        total_f += scores.sum(0)
        total_g.append(scores.sum(1))
    given_f = f.new_zeros(target.size, source.size)
    given_f.index_add_(0, owner_f, torch.softmax(best_f, 0).t())
    votes = (given_f + _NO_VOTE).log() + (given_g.t() + _NO_VOTE).log()
    totals = (total_f, torch.cat(total_g) if total_g else g.new_zeros(0))
    places = ((target, at_target), (source, at_source))
    spread = [
        voters.features.new_full((len(voters.features),), torch.inf).index_copy_(
            0, at, total.clamp_min(least).log() + highest
        )
        for (voters, at), total in zip(places, totals, strict=True)
    ]
    return PointSimilarity(votes, features[0], features[1], spread[0], spread[1])
