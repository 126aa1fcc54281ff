# SPDX-License-Identifier: MIT
"""What speaks for a superpoint being seen by the other cloud too, besides its own feature.

Not in the published network, whose mask predictor sees features and image alone. Features of the backbone tell what a
place looks like; whether the other cloud has such a place, they do not.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional as F

SIZE = 5
_BLOCK = 1024


def superpoint_evidence(
    sizes: tuple[int, int],
    features: tuple[Tensor, Tensor],
    owners: tuple[Tensor, Tensor],
    temperature: float,
) -> tuple[Tensor, Tensor]:
    """(m, 5), (n, 5) of order one: mean and largest likeness of a superpoint's points with their likest partners, the
    same of their uniqueness, and how many points it has. No motion of a cloud changes them.

    Parameters
    ----------
    sizes
        m and n, numbers of superpoints.
    features
        (M, d), (N, d) of the fine points. No gradient goes back to them.
    owners
        (M,), (N,) int64: the superpoint of each fine point.
    temperature
        Of the softmax over all points of the other cloud.
    """
    f, g = (F.normalize(one.detach(), dim=1) for one in features)
    (best_f, total_f), (best_g, total_g) = _partners(f, g, temperature)
    sides = ((sizes[0], owners[0], best_f, total_f), (sizes[1], owners[1], best_g, total_g))
    target, source = (_gathered(*side, temperature) for side in sides)
    return target, source


def _partners(
    f: Tensor, g: Tensor, temperature: float
) -> tuple[tuple[Tensor, Tensor], tuple[Tensor, Tensor]]:
    # Of each point of both clouds the likeness of the likest partner, and the logarithm of the softmax's denominator.
    best_f, total_f = [], []
    best_g, total_g = g.new_full((len(g),), -1.0), g.new_zeros(len(g))
    for block in f.split(_BLOCK):
        scores = block @ g.t()
        best_f.append(scores.amax(1))
        best_g = torch.maximum(best_g, scores.amax(0))
        # At most one: no exponential overflows.
        scores.sub_(1.0).div_(temperature).exp_()
        total_f.append(scores.sum(1))
        total_g += scores.sum(0)
    least, shift = torch.finfo(f.dtype).tiny, 1.0 / temperature
    logs = (total.clamp_min(least).log() + shift for total in (torch.cat(total_f), total_g))
    return (torch.cat(best_f), next(logs)), (best_g, next(logs))


def _gathered(n: int, owner: Tensor, best: Tensor, total: Tensor, temperature: float) -> Tensor:
    sure = best / temperature - total  # log of the softmax at the likest partner
    count = torch.bincount(owner, minlength=n).to(best.dtype)
    columns = []
    for value in (best, sure / 4.0):
        mean = torch.zeros_like(count).index_add_(0, owner, value) / count.clamp_min(1.0)
        top = torch.full_like(count, float(value.min())).scatter_reduce_(0, owner, value, "amax")
        columns += [mean, top]
    columns += [count.log1p() / 3.0]
    return torch.stack(columns, 1)
