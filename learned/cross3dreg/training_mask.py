# SPDX-License-Identifier: MIT
"""Which superpoints a training step keeps: jittered teacher forcing, later the prediction (docs/methods.md 5.4)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.superpoint_mask import Kept, cap


@dataclass(frozen=True, kw_only=True)
class MaskJitter:
    """How the true mask is perturbed, so that the matcher learns to work with a predicted one."""

    drop_positive: float = 0.1  # share of the true superpoints left out
    keep_negative: float = 0.3  # share of the others kept
    use_predicted: float = 0.0  # probability of the predicted mask and half the truth; 0.5 from epoch 5
    threshold: float = 0.5


def training_mask(
    truth: Tensor, logits: Tensor, limit: int, jitter: MaskJitter, rng: torch.Generator
) -> Kept:
    """Superpoints of one cloud that this step keeps, at least one.

    Parameters
    ----------
    truth, logits
        (n,) bool and (n,) predicted logits; no gradient passes the choice.
    limit
        Most superpoints to keep, positives first.
    """
    draw = torch.rand(len(truth), generator=rng).to(truth.device)
    if float(torch.rand((), generator=rng)) < jitter.use_predicted:
        keep = (torch.sigmoid(logits.detach()) > jitter.threshold) | (truth & (draw < 0.5))
    else:
        keep = torch.where(truth, draw >= jitter.drop_positive, draw < jitter.keep_negative)
    if not bool(keep.any()):
        keep = torch.ones_like(keep)
    return cap(Kept(keep.nonzero()[:, 0]), truth.float() + draw, limit)
