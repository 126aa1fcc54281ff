# SPDX-License-Identifier: MIT
"""Rigid kernel point convolution (KPConv) with GeoTransformer's positive-sum normaliser (methods 3.2)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.influence import Influence


def kernel_point_convolution(
    features: Tensor, neighbors: Tensor, influence: Influence, weights: Tensor, bias: Tensor
) -> Tensor:
    """Convolve: ``f_i = 1/n_i sum_k (sum_j h_ijk F_j) W_k + b``.

    Parameters
    ----------
    features
        (M, C_in) of the supports.
    neighbors
        (N, k) int64 into the supports, pad M.
    influence
        Of the same queries, supports and neighbours.
    weights
        (K, C_in, C_out).
    bias
        (C_out,).

    Returns
    -------
    Tensor
        (N, C_out).
    """
    total: Tensor = _WeightedSums.apply(features, weights, influence)
    share = _positive_neighbors(features.detach(), neighbors).to(features.dtype).reciprocal()
    return torch.addcmul(bias, total, share[:, None])


class _WeightedSums(torch.autograd.Function):
    """``sum_k H_k F W_k`` with the sparse influences H_k, kernel point by kernel point."""

    @staticmethod
    def forward(ctx: Any, features: Tensor, weights: Tensor, influence: Influence) -> Tensor:
        ctx.influence = influence
        kept = []
        out = features.new_zeros(len(influence.bags[0].offsets), weights.shape[2])
        for bags, weight in zip(influence.bags, weights, strict=True):
            gathered = bags.sum_detached(features)
            out.addmm_(gathered, weight)
            if ctx.needs_input_grad[1]:
                kept.append(gathered)
        ctx.save_for_backward(weights, *kept)
        return out

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
        weights, *kept = ctx.saved_tensors
        of_features = of_weights = None
        if ctx.needs_input_grad[0]:
            # all kernel points in one product and one sum
            n_kernel, dim_in, dim_out = weights.shape
            flat = gradient @ weights.view(n_kernel * dim_in, dim_out).t()
            of_features = ctx.influence.transposed.sum_detached(flat.view(-1, dim_in))
        if ctx.needs_input_grad[1]:
            of_weights = torch.stack([gathered.t() @ gradient for gathered in kept])
        return of_features, of_weights, None


def _positive_neighbors(features: Tensor, neighbors: Tensor) -> Tensor:
    positive = F.pad((features.sum(1) > 0).view(torch.uint8), (0, 1))
    return (
        positive.index_select(0, neighbors.flatten())
        .view(neighbors.shape)
        .sum(1, dtype=torch.int32)
        .clamp_min_(1)
    )


class KPConv(nn.Module):
    """A kernel point convolution from ``dim_in`` to ``dim_out`` channels.

    ``points`` (K, 3) are the kernel points and ``sigma`` their reach, in metres.
    """

    kernel: Tensor

    def __init__(self, dim_in: int, dim_out: int, sigma: float, points: npt.NDArray[np.float32]) -> None:
        super().__init__()
        self.sigma = sigma
        self.weights = nn.Parameter(torch.empty(len(points), dim_in, dim_out))
        self.bias = nn.Parameter(torch.empty(dim_out))
        self.register_buffer("kernel", torch.from_numpy(points))
        bound = 1.0 / math.sqrt(dim_in * dim_out)
        nn.init.uniform_(self.weights, -bound, bound)
        nn.init.uniform_(self.bias, -bound, bound)

    def forward(self, features: Tensor, neighbors: Tensor, influence: Influence) -> Tensor:
        """(M, C_in) to (N, C_out)."""
        return kernel_point_convolution(features, neighbors, influence, self.weights, self.bias)
