# SPDX-License-Identifier: MIT
"""Squared distances by the expanded square, in the rounding that the published networks were trained with."""

from __future__ import annotations

from torch import Tensor


def squared_distances(first: Tensor, second: Tensor, *, unit: bool = False) -> Tensor:
    """(..., n, c) and (..., m, c) to (..., n, m), not below 0.

    The expanded square keeps only half of float32's digits for near points. It is used wherever a published network
    decides by it (which patch, which match), so that the decisions agree; neighbour searches subtract first. ``unit``
    says that all rows have length one.
    """
    product = first @ second.transpose(-1, -2)
    if unit:
        return (2.0 - 2.0 * product).clamp_min(0.0)
    lengths = first.square().sum(-1)[..., :, None] + second.square().sum(-1)[..., None, :]
    return (lengths - 2.0 * product).clamp_min(0.0)
