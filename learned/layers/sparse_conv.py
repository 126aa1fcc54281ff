# SPDX-License-Identifier: MIT
"""Sparse 3-D convolution in plain torch: gather, one matrix product per offset, scatter-add.

Tensors have the layout of MinkowskiEngine (0.5.4), so that weights trained there fit.
"""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.layers.kernel_maps import KernelMap, Pairs

# Up to this many input channels one product with all offsets is cheaper than one product per offset.
FEW_CHANNELS = 4


class SparseConv(nn.Module):
    """Convolution over occupied voxels: output o is the sum of ``features[i] @ kernel[k]`` over its pairs (i, k).

    Parameters
    ----------
    dim_in, dim_out
        Channels.
    size
        Edge of the kernel. With an edge of 1 the kernel is a matrix (dim_in, dim_out), otherwise (size^3, dim_in,
        dim_out).
    transposed
        Go back from the coarse voxels of a map to the fine ones. Initial weights are uniform within
        1 / sqrt(dim * size^3), ``dim`` the outputs of a transposed convolution and the inputs of others
        (MinkowskiConvolution.py 332-340).
    """

    def __init__(
        self, dim_in: int, dim_out: int, size: int, *, transposed: bool = False, bias: bool = False
    ) -> None:
        super().__init__()
        self.size, self.transposed = size, transposed
        volume = size**3
        bound = 1.0 / math.sqrt((dim_out if transposed else dim_in) * volume)
        shape = (dim_in, dim_out) if volume == 1 else (volume, dim_in, dim_out)
        self.kernel = nn.Parameter(torch.empty(shape).uniform_(-bound, bound))
        self.bias = nn.Parameter(torch.empty(1, dim_out).uniform_(-bound, bound)) if bias else None

    def forward(self, features: Tensor, voxels: KernelMap | None) -> Tensor:
        """Features (N, dim_in) of the input voxels to (M, dim_out) of the output's; a 1x1x1 kernel needs no map."""
        if self.size == 1:
            out = features @ self.kernel
        else:
            assert voxels is not None, "a kernel wider than 1 needs a map"
            out = convolve(features, self.kernel, voxels, transposed=self.transposed)
        return out if self.bias is None else out + self.bias


def convolve(features: Tensor, kernel: Tensor, voxels: KernelMap, *, transposed: bool = False) -> Tensor:
    """Features (N, C) and a kernel (K^3, C, D) to (M, D), from a map's inputs to its outputs or, transposed, back."""
    if features.shape[1] <= FEW_CHANNELS and not transposed:
        return _all_offsets(features, kernel, voxels)
    out: Tensor = _Convolution.apply(
        features, kernel, voxels.pairs.transposed if transposed else voxels.pairs
    )
    return out


def _all_offsets(features: Tensor, kernel: Tensor, voxels: KernelMap) -> Tensor:
    padded = torch.cat([features, features.new_zeros(1, features.shape[1])])
    # A single channel in one dimension: a third of the time.
    columns = padded.squeeze(1).index_select(0, voxels.table.flatten())
    columns = columns.view(*voxels.table.shape, -1).transpose(0, 1)
    return columns.flatten(1) @ kernel.reshape(-1, kernel.shape[2])


class _Convolution(torch.autograd.Function):
    # torch would keep every gathered row for the gradient.
    @staticmethod
    def forward(ctx: Any, features: Tensor, kernel: Tensor, pairs: Pairs) -> Tensor:
        ctx.save_for_backward(features, kernel)
        ctx.pairs = pairs
        return _added(features, kernel, pairs)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
        (features, kernel), pairs = ctx.saved_tensors, ctx.pairs
        gradient = gradient.contiguous()
        of_features = of_kernel = None
        if ctx.needs_input_grad[0]:
            of_features = _added(gradient, kernel.transpose(1, 2), pairs.transposed)
        if ctx.needs_input_grad[1]:
            parts = zip(pairs.input.split(pairs.counts), pairs.output.split(pairs.counts), strict=True)
            of_kernel = torch.stack([features[i].t() @ gradient[o] for i, o in parts])
        return of_features, of_kernel, None


def _added(rows: Tensor, matrices: Tensor, pairs: Pairs) -> Tensor:
    if len(pairs) == 0:
        return rows.new_zeros(pairs.n_output, matrices.shape[2])
    products = rows.new_empty(len(pairs), matrices.shape[2])
    gathered = rows.new_empty(max(pairs.counts), rows.shape[1])
    parts = zip(
        pairs.input.split(pairs.counts), matrices.unbind(0), products.split(pairs.counts), strict=True
    )
    for index, matrix, out in parts:
        if len(index):
            part = torch.index_select(rows, 0, index, out=gathered[: len(index)])
            torch.mm(part, matrix, out=out)
    return F.embedding_bag(pairs.by_output[0], products, pairs.by_output[1], mode="sum")
