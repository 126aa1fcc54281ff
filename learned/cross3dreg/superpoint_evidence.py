# SPDX-License-Identifier: MIT
"""Evidence besides its own feature that a superpoint lies in the overlap.

Not in the published network, whose mask predictor sees only features and image. Features of the backbone describe what
a place looks like, not whether the other cloud contains such a place.
"""

from __future__ import annotations

from typing import NamedTuple

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
    """(m, 5), (n, 5) of order one: mean and largest similarity of a superpoint's points to their best matches, the
    same for their uniqueness, and the number of its points. Invariant to motions of the clouds.

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
    of_f, of_g = partners(f, g, temperature)
    return _gathered(sizes[0], owners[0], of_f), _gathered(sizes[1], owners[1], of_g)


class Partners(NamedTuple):
    """For each point of a cloud (n,): cosine with its most similar point, and the logarithm of its softmax."""

    best: Tensor
    sure: Tensor


def partners(f: Tensor, g: Tensor, temperature: float) -> tuple[Partners, Partners]:
    """The most similar points of unit features (M, d), (N, d), from all pairs in one pass."""
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

    def told(best: Tensor, total: Tensor) -> Partners:
        return Partners(
            best, (best - 1.0) / temperature - total.clamp_min(torch.finfo(total.dtype).tiny).log()
        )

    return told(torch.cat(best_f), torch.cat(total_f)), told(best_g, total_g)


def _gathered(n: int, owner: Tensor, found: Partners) -> Tensor:
    best, sure = found
    count = torch.bincount(owner, minlength=n).to(best.dtype)
    columns = []
    for value in (best, sure / 4.0):
        mean = torch.zeros_like(count).index_add_(0, owner, value) / count.clamp_min(1.0)
        top = torch.full_like(count, float(value.min())).scatter_reduce_(0, owner, value, "amax")
        columns += [mean, top]
    columns += [count.log1p() / 3.0]
    return torch.stack(columns, 1)
