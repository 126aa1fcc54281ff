# SPDX-License-Identifier: MIT
"""Superpoint matching with an adaptive number of pairs, as RoITr does on 4DMatch."""

from __future__ import annotations

import torch
from torch import Tensor

from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.matching.superpoint_matching import SuperpointMatches


def match_adaptively(target: Tensor, source: Tensor, least: int, farthest: float) -> SuperpointMatches:
    """All pairs whose features are at most ``farthest`` apart (model/modules.py, AdaptiveSuperPointMatching).

    Parameters
    ----------
    target, source
        (m, c), (n, c) features of length one.
    least
        Where fewer pairs are near enough, this many nearest ones, best first. Otherwise rows in order, not sorted.
    farthest
        Euclidean distance of two features.

    Returns
    -------
    SuperpointMatches
        With scores ``exp(-distance)``.
    """
    distance = squared_distances(target, source, unit=True).sqrt()
    near = distance <= farthest
    if int(near.sum()) < min(least, distance.numel()):
        found, index = distance.flatten().topk(min(least, distance.numel()), largest=False)
        rows, columns = (
            index.div(max(1, distance.shape[1]), rounding_mode="floor"),
            index % max(1, distance.shape[1]),
        )
        return SuperpointMatches(rows, columns, torch.exp(-found))
    rows, columns = near.nonzero(as_tuple=True)
    return SuperpointMatches(rows, columns, torch.exp(-distance[rows, columns]))
