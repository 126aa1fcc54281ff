# SPDX-License-Identifier: MIT
"""The mask loss: focal loss on the overlap logits (docs/methods.md 5.3)."""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor
from torch.nn import functional as F


def focal_loss(
    logits: Tensor,
    truth: Tensor,
    *,
    alpha: float = 0.25,
    gamma: float = 2.0,
    alpha_mode: Literal["constant", "balanced"] = "constant",
) -> Tensor:
    """Mean of ``-alpha (1 - p_t)^gamma log p_t`` over superpoints (n,); 0 for none.

    The paper multiplies both classes by alpha (``constant``); the original focal loss takes 1 - alpha for the
    negatives (``balanced``).
    """
    if len(logits) == 0:
        return logits.sum() * 0.0
    signed = torch.where(truth, logits, -logits)  # sigmoid(signed) is p_t
    factor = torch.full_like(logits, alpha)
    if alpha_mode == "balanced":
        factor = torch.where(truth, alpha, 1.0 - alpha).to(logits.dtype)
    return -(factor * torch.sigmoid(-signed) ** gamma * F.logsigmoid(signed)).mean()
