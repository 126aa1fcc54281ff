# SPDX-License-Identifier: MIT
"""Total loss: coarse, fine and mask loss together (docs/methods.md 10.3)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.config import LossConfig
from hybridreg.learned.cross3dreg.overlap_predictor import OverlapLogits
from hybridreg.learned.cross3dreg.superpoint_mask import Kept
from hybridreg.learned.cross3dreg.targets import Targets
from hybridreg.learned.losses.focal_loss import focal_loss


@dataclass(frozen=True)
class Losses:
    """The parts of the training loss; the paper adds them with weights of one."""

    coarse: Tensor
    fine: Tensor
    mask: Tensor

    @property
    def total(self) -> Tensor:
        """Their plain sum."""
        return self.coarse + self.fine + self.mask


def overlap_matrix(targets: Targets, kept: tuple[Kept, Kept]) -> Tensor:
    """(m, n) true overlaps among the kept superpoints; pairs with a masked superpoint are dropped."""
    full = targets.overlap.new_zeros(len(targets.mask_target), len(targets.mask_source))
    full[targets.target, targets.source] = targets.overlap
    return full[kept[0].index][:, kept[1].index]


def mask_loss(overlap: OverlapLogits | None, targets: Targets, config: LossConfig) -> Tensor:
    """Mean of both clouds' focal losses; 0 without OMP."""
    if overlap is None:
        return targets.overlap.new_zeros(())
    sides = ((overlap.target, targets.mask_target), (overlap.source, targets.mask_source))
    losses = [
        focal_loss(
            logits,
            truth,
            alpha=config.focal_alpha,
            gamma=config.focal_gamma,
            alpha_mode=config.focal_alpha_mode,
        )
        for logits, truth in sides
    ]
    return torch.stack(losses).mean()
