# SPDX-License-Identifier: MIT
"""Circle loss (Sun et al. 2020) on features; the coarse loss weights it by patch overlap (docs/methods.md 10.1)."""

from __future__ import annotations

from typing import Protocol

import torch
from torch import Tensor
from torch.nn import functional as F

from hybridreg.learned.cross3dreg.config import LossConfig
from hybridreg.learned.layers.distances import squared_distances


class CircleMargins(Protocol):
    """Margins and scale of a circle loss."""

    @property
    def positive_margin(self) -> float: ...
    @property
    def negative_margin(self) -> float: ...
    @property
    def positive_optimal(self) -> float: ...
    @property
    def negative_optimal(self) -> float: ...
    @property
    def log_scale(self) -> float: ...


def circle_loss(target: Tensor, source: Tensor, overlap: Tensor, config: LossConfig) -> Tensor:
    """Overlap-weighted circle loss.

    Parameters
    ----------
    target, source
        (m, c), (n, c) features of length one.
    overlap
        (m, n) in [0, 1]; above ``positive_overlap`` a pair is positive, at 0 negative, between ignored.

    Returns
    -------
    Tensor
        Scalar. Where no row or no column has both a positive and a negative, that half is 0 and keeps the graph.
    """
    # 1e-12 keeps the gradient of the root finite where two features agree.
    distance = (squared_distances(target, source, unit=True) + 1e-12).sqrt()
    positive, negative = overlap > config.positive_overlap, overlap == 0
    return circle(distance, positive, negative, config, overlap.sqrt())


def circle(
    distance: Tensor,
    positive: Tensor,
    negative: Tensor,
    config: CircleMargins,
    weight: Tensor | float = 1.0,
) -> Tensor:
    """Circle loss of a matrix of feature distances, mean of its rows' and its columns' losses.

    Parameters
    ----------
    distance
        (m, n).
    positive, negative
        (m, n) bool; pairs that are neither add a constant.
    weight
        Of the positives.

    Returns
    -------
    Tensor
        Scalar, as `circle_loss`.
    """
    pull, push = _exponents(distance, positive, negative, weight, config)
    rows = positive.any(1) & negative.any(1)
    columns = positive.any(0) & negative.any(0)
    by_row = _side(pull, push, 1, rows, config.log_scale)
    by_column = _side(pull, push, 0, columns, config.log_scale)
    return (by_row + by_column) / 2


def _exponents(
    distance: Tensor, positive: Tensor, negative: Tensor, weight: Tensor | float, config: CircleMargins
) -> tuple[Tensor, Tensor]:
    # Entries that are neither get weight 0, hence exponent 0: a constant in the sum, as in the published loss.
    fixed = distance.detach()
    pull_weight = (fixed - config.positive_optimal).clamp_min(0.0) * weight * positive
    push_weight = (config.negative_optimal - fixed).clamp_min(0.0) * negative
    pull = config.log_scale * (distance - config.positive_margin) * pull_weight
    push = config.log_scale * (config.negative_margin - distance) * push_weight
    return pull, push


def _side(pull: Tensor, push: Tensor, dim: int, valid: Tensor, scale: float) -> Tensor:
    if not bool(valid.any()):
        return pull.sum() * 0.0
    exponent = torch.logsumexp(pull, dim) + torch.logsumexp(push, dim)
    return (F.softplus(exponent) / scale)[valid].mean()
