# SPDX-License-Identifier: MIT
"""Consistency of matches: correct ones preserve all mutual distances, wrong ones preserve few by chance.

Spectral matching (Leordeanu and Hebert, ICCV 2005) with the compatibility of SC2-PCR and MAC, ``1 - (d - d')^2 / s^2``.
"""

from __future__ import annotations

import torch
from torch import Tensor

# Matches compared with each other, those with the largest weights: a square matrix of 36 MB.
_MOST = 3000
# Power iterations; the leading eigenvector is well separated where there is one.
_ITERATIONS = 20
# Share of the best match's consistency that a match needs.
_SHARE = 0.3


def consistent(target: Tensor, source: Tensor, weight: Tensor, reach: float) -> Tensor:
    """Which of the matches belong to the largest mutually consistent group.

    Parameters
    ----------
    target, source
        (C, 3), (C, 3) metres.
    weight
        (C,) by which at most 3,000 are chosen; the others are left out.
    reach
        Metres by which two distances may differ.

    Returns
    -------
    Tensor
        (C,) bool; all true where there are fewer than three, or no two that could be right together.
    """
    keep = torch.zeros(len(weight), dtype=torch.bool, device=weight.device)
    if len(weight) < 3:
        return ~keep
    chosen = weight.argsort(descending=True, stable=True)[:_MOST]
    p, q = source[chosen], target[chosen]
    apart = (torch.cdist(p, p) - torch.cdist(q, q)) / reach
    compatible = (1.0 - apart.square()).clamp_min_(0.0).fill_diagonal_(0.0)
    agreement = compatible.new_full((len(chosen),), len(chosen) ** -0.5)
    for _ in range(_ITERATIONS):
        agreement = compatible @ agreement
        agreement = agreement / agreement.norm().clamp_min(1e-12)
    keep[chosen[agreement >= _SHARE * agreement.max()]] = True
    return keep
