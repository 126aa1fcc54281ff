# SPDX-License-Identifier: MIT
"""Rigid kernel point convolution (KPConv) with GeoTransformer's positive-sum normaliser (docs/methods.md 3.2)."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.layers.dense_influence import DenseInfluence
from hybridreg.learned.layers.influence import Influence


def kernel_point_convolution(
    features: Tensor,
    neighbors: Tensor,
    influence: Influence | DenseInfluence,
    weights: Tensor,
    bias: Tensor | None,
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
        (C_out,), or None.

    Returns
    -------
    Tensor
        (N, C_out).
    """
    total = influence.convolve(features, weights)
    share = _positive_neighbors(features.detach(), neighbors).to(features.dtype).reciprocal()
    return total * share[:, None] if bias is None else torch.addcmul(bias, total, share[:, None])


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

    ``points`` (K, 3) are the kernel points and ``sigma`` their influence radius, in metres. GeoTransformer has a
    ``bias``, Predator and CoFiNet have none.
    """

    kernel: Tensor

    def __init__(
        self, dim_in: int, dim_out: int, sigma: float, points: npt.NDArray[np.float32], *, bias: bool = True
    ) -> None:
        super().__init__()
        self.sigma = sigma
        self.weights = nn.Parameter(torch.empty(len(points), dim_in, dim_out))
        self.bias = nn.Parameter(torch.empty(dim_out)) if bias else None
        self.register_buffer("kernel", torch.from_numpy(points))
        bound = 1.0 / math.sqrt(dim_in * dim_out)
        nn.init.uniform_(self.weights, -bound, bound)
        if self.bias is not None:
            nn.init.uniform_(self.bias, -bound, bound)

    def forward(self, features: Tensor, neighbors: Tensor, influence: Influence | DenseInfluence) -> Tensor:
        """(M, C_in) to (N, C_out)."""
        return kernel_point_convolution(features, neighbors, influence, self.weights, self.bias)
