# SPDX-License-Identifier: MIT
"""Instance normalisation over the rows of each matrix of a stack, without weights or running statistics."""

from __future__ import annotations

from torch import Tensor

_EPS = 1e-5


def instance_norm(features: Tensor, mask: Tensor | None = None) -> Tensor:
    """Normalise (..., n, C) over n, each channel apart; ``mask`` (..., n) bool says which rows count.

    Rows that do not count are scaled and shifted with the others. With a single row all is 0.
    """
    if mask is None:
        mean = features.mean(-2, keepdim=True)
        centred = features - mean
        return centred * (centred.square().mean(-2, keepdim=True) + _EPS).rsqrt()
    counts = mask.to(features.dtype)[..., None]
    total = counts.sum(-2, keepdim=True).clamp_min(1.0)
    mean = (features * counts).sum(-2, keepdim=True) / total
    centred = features - mean
    variance = (centred.square() * counts).sum(-2, keepdim=True) / total
    return centred * (variance + _EPS).rsqrt()
