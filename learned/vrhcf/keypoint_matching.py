# SPDX-License-Identifier: MIT
"""VRHCF's matching of descriptors: every source keypoint gets its nearest target keypoint, in one direction."""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor

_EPS = 1e-6
_ROWS = 1024


def match_descriptors(source: Tensor, target: Tensor, matching: Literal["channels", "unit"]) -> Tensor:
    """Rows (n,) int64 of the target's descriptors (m, d) that are nearest to the source's (n, d).

    "channels" divides each channel by its length over all keypoints of a cloud before descriptors are compared by
    their product. That is what was released and gave the published numbers (module/HCF_module.py normalises the wrong
    dimension): long descriptors win, and a keypoint's match depends on which other keypoints there are. "unit" divides
    each descriptor by its own length, as intended.
    """
    dim = 0 if matching == "channels" else 1
    source, target = (d / (d.norm(dim=dim, keepdim=True) + _EPS) for d in (source, target))
    # The distance of unit vectors, in the original's rounding: its square root creates ties that the product does not
    # have.
    blocks = [
        (2.0 - 2.0 * (block @ target.T) + _EPS).clamp_min(0.0).sqrt().argmin(1)
        for block in source.split(_ROWS)
    ]
    return torch.cat(blocks)
