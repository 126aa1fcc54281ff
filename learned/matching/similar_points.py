# SPDX-License-Identifier: MIT
"""Points of two clouds whose features are alike: many pairs, few of them right, from which poses are told apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.matches import Described

Array = NDArray[np.float64]

# Partners of a point, in either direction; one or two did as well on `sim:val`, 150 pairs.
_PARTNERS = 3
# Of the softmax over the other cloud's points; as in the votes for superpoint pairs (docs/methods.md 7.3).
_TEMPERATURE = 0.05


class SimilarPoints(NamedTuple):
    """Pairs of points, and how much each counts.

    Attributes
    ----------
    source, target : (K, 3) float64
        Metres, each in its cloud's frame.
    weight : (K,) float64 in (0, 1]
        One where each point is the other's only match, and less the more others are as similar.
    """

    source: Array
    target: Array
    weight: Array

    def support(self, T_target_source: Array, radius: float) -> float:
        """Sum of the weights, each the smaller the farther its points are from each other; none beyond ``radius``."""
        squares = np.sum((se3.apply(T_target_source, self.source) - self.target) ** 2, axis=1)
        return float(self.weight @ np.maximum(1.0 - squares / radius**2, 0.0))


def similar_points(source: Described, target: Described) -> SimilarPoints:
    """Each point with the three most similar ones of the other cloud.

    The weight is the geometric mean of two softmaxes of the cosine, over the target's points and over the source's.
    """
    cosine = torch.from_numpy(source.features) @ torch.from_numpy(target.features).t()
    n, m = cosine.shape
    to_target = cosine.topk(min(_PARTNERS, m), dim=1).indices
    to_source = cosine.topk(min(_PARTNERS, n), dim=0).indices
    there = torch.arange(n)[:, None] * m + to_target
    back = to_source * m + torch.arange(m)
    pair = torch.unique(torch.cat([there.flatten(), back.flatten()]))
    i, j = pair // m, pair % m
    share = cosine.sub_(1.0).div_(_TEMPERATURE).exp_()
    weight = share[i, j] / (share.sum(1)[i] * share.sum(0)[j]).sqrt()
    rows, columns = i.numpy(), j.numpy()
    return SimilarPoints(source.points[rows], target.points[columns], weight.numpy().astype(np.float64))
