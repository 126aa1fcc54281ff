# SPDX-License-Identifier: MIT
"""The fine loss: negative log-likelihood of the true assignment of patch pairs (docs/methods.md 10.2)."""

from __future__ import annotations

from torch import Tensor

from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.layers.kpconv_blocks import pad_row
from hybridreg.learned.matching.patch_pairs import PatchPairs
from hybridreg.learned.matching.procrustes import apply_transform


def assignment_loss(
    assignment: Tensor, pairs: PatchPairs, target: Tensor, source: Tensor, transform: Tensor, radius: float
) -> Tensor:
    """Minus the mean log-assignment of true correspondences, and of the slack for points without one.

    Parameters
    ----------
    assignment
        (B, n + 1, m + 1) log-assignments of the pairs; B may be 0, then the loss is 0 and keeps the graph.
    pairs
        The pairs.
    target, source
        (N, 3), (M, 3) fine points in their own frames, metres.
    transform
        (4, 4) true ``T_target_source``.
    radius
        Points closer than this under the true pose correspond, metres.
    """
    labels = true_assignment(pairs, target, source, transform, radius)
    if not bool(labels.any()):
        return assignment.sum() * 0.0
    return -assignment[labels].mean()


def true_assignment(
    pairs: PatchPairs, target: Tensor, source: Tensor, transform: Tensor, radius: float
) -> Tensor:
    """(B, n + 1, m + 1) bool: true correspondences, and the slack of valid points that have none."""
    points_target = pad_row(target)[pairs.target_index]
    points_source = apply_transform(pad_row(source)[pairs.source_index], transform)
    near = squared_distances(points_target, points_source) < radius**2
    near &= pairs.target_mask[:, :, None] & pairs.source_mask[:, None]
    batch, n, m = near.shape
    labels = near.new_zeros(batch, n + 1, m + 1)
    labels[:, :-1, :-1] = near
    labels[:, :-1, -1] = pairs.target_mask & ~near.any(2)
    labels[:, -1, :-1] = pairs.source_mask & ~near.any(1)
    return labels
