# SPDX-License-Identifier: MIT
"""A smooth function of one number, tabulated once and interpolated: for embeddings of very many numbers."""

from __future__ import annotations

import torch
from torch import Tensor

from hybridreg.learned.layers.sparse_rows import Bags

# Samples per unit. A cubic through four of them is within 4e-7 of a sine of frequency 1, float32's own rounding.
_DENSITY = 16


def sample_positions(highest: float, like: Tensor) -> Tensor:
    """Where to evaluate a curve (n,) that will be interpolated at 0 to ``highest``."""
    n = int(highest * _DENSITY) + 4
    return torch.arange(-1, n - 1, dtype=like.dtype, device=like.device) / _DENSITY


def interpolate(samples: Tensor, values: Tensor) -> Tensor:
    """The curve (n, d), sampled at `sample_positions`, at ``values`` (...): (..., d)."""
    index, weight = between(values.flatten())
    starts = torch.arange(0, index.numel(), index.shape[1], device=index.device)
    return Bags(index.flatten(), weight.flatten(), starts, len(samples)).sum(samples).view(*values.shape, -1)


def between(values: Tensor) -> tuple[Tensor, Tensor]:
    """Which four samples (n, 4) a curve at ``values`` (n,) is interpolated from, and their weights (n, 4)."""
    steps = values * _DENSITY
    cell = steps.floor()
    return cell.long()[:, None] + torch.arange(4, device=values.device), _cubic_weights(steps - cell)


def _cubic_weights(t: Tensor) -> Tensor:
    """Lagrange's weights (n, 4) of the samples at -1, 0, 1 and 2 at positions ``t`` (n,) in [0, 1)."""
    before, after, last = t + 1, t - 1, t - 2
    return torch.stack(
        [-t * after * last / 6, before * after * last / 2, -before * t * last / 2, before * t * after / 6],
        dim=1,
    )
