# SPDX-License-Identifier: MIT
"""CoFiNet's two losses, and the quality of its matches (docs/methods.md 11.3)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.cofinet.config import CofinetLossConfig
from hybridreg.learned.cofinet.point_transport import either_best
from hybridreg.learned.cofinet.targets import CofinetTargets

_FOUND = 0.1


@dataclass(frozen=True, kw_only=True)
class CofinetLosses:
    """The parts of the training loss, and two measures of the matches."""

    coarse: Tensor
    fine: Tensor
    total: Tensor  # with the configuration's weights
    # As published, and not a share: true superpoint pairs above 0.1, over the sum of all weights including the
    # slack's. A perfect result may have less or more than 1.
    coarse_recall: Tensor
    # Share of correct matches of a patch pair, mean over the drawn pairs; a pair without matches counts as 0.
    fine_precision: Tensor

    @property
    def parts(self) -> dict[str, Tensor]:
        """Before weighting, for the log."""
        return {"coarse": self.coarse, "fine": self.fine}

    @property
    def hits(self) -> Tensor:
        """The precision of the point matches."""
        return self.fine_precision


def cofinet_losses(
    coarse: Tensor, fine: Tensor, targets: CofinetTargets, config: CofinetLossConfig
) -> CofinetLosses:
    """Losses of a pair, ready for ``backward``; finite for pairs without overlap too.

    Parameters
    ----------
    coarse
        (n + 1, m + 1) log-assignment of the superpoints.
    fine
        (B, P + 1, P + 1) of the points of the drawn pairs.
    """
    parts = transport_loss(coarse, targets.coarse), transport_loss(fine, targets.fine)
    return CofinetLosses(
        coarse=parts[0],
        fine=parts[1],
        total=config.coarse_weight * parts[0] + config.fine_weight * parts[1],
        coarse_recall=coarse_recall(coarse.detach(), targets.coarse),
        fine_precision=fine_precision(fine.detach(), targets.fine),
    )


def transport_loss(log_assignment: Tensor, weights: Tensor) -> Tensor:
    """Mean of the negative log-assignment with the true weights, including the slack."""
    return -(log_assignment * weights).sum() / weights.sum().clamp_min(1e-9)


def coarse_recall(log_assignment: Tensor, weights: Tensor) -> Tensor:
    """True pairs with a probability above 0.1, over the sum of all weights."""
    found = (log_assignment.exp() > _FOUND) & (weights > 0)
    return found[:-1, :-1].sum() / weights.sum().clamp_min(1e-9)


def fine_precision(log_assignment: Tensor, truth: Tensor) -> Tensor:
    """Share of correct matches of each pair, mean over the pairs."""
    if len(truth) == 0:
        return torch.zeros((), device=truth.device)
    chosen = either_best(log_assignment)
    right = (chosen & (truth[:, :-1, :-1] > 0)).sum((1, 2))
    return (right / chosen.sum((1, 2)).clamp_min(1)).mean()
