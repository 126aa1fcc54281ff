# SPDX-License-Identifier: MIT
"""Sparse 3-D convolution in plain torch: gather, one matrix product an offset, sum.

The tensors and what they mean are MinkowskiEngine's (0.5.4), so that weights trained there fit.
"""

from __future__ import annotations

import math
from itertools import accumulate
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.layers.voxels import KernelMap

# Up to so many input channels a product with all offsets at once is cheaper than one product an offset.
_FEW_CHANNELS = 4


class SparseConv(nn.Module):
    """Convolution over occupied voxels: output o is the sum of ``features[i] @ kernel[k]`` over its pairs (i, k).

    Parameters
    ----------
    dim_in, dim_out
        Channels.
    size
        Edge of the kernel. Of an edge of 1 the kernel is a matrix (dim_in, dim_out), else (size^3, dim_in, dim_out).
    transposed
        Only for the initial weights: uniform within 1 / sqrt(dim * size^3), ``dim`` the outputs of a transposed
        convolution and the inputs of others (MinkowskiConvolution.py). The map decides what is computed.
    """

    def __init__(
        self, dim_in: int, dim_out: int, size: int, *, transposed: bool = False, bias: bool = False
    ) -> None:
        super().__init__()
        self.size = size
        volume = size**3
        bound = 1.0 / math.sqrt((dim_out if transposed else dim_in) * volume)
        shape = (dim_in, dim_out) if volume == 1 else (volume, dim_in, dim_out)
        self.kernel = nn.Parameter(torch.empty(shape).uniform_(-bound, bound))
        self.bias = nn.Parameter(torch.empty(1, dim_out).uniform_(-bound, bound)) if bias else None

    def forward(self, features: Tensor, pairs: KernelMap | None) -> Tensor:
        """Features (N, dim_in) of the input voxels to (M, dim_out) of the output's; a 1x1x1 kernel needs no pairs."""
        if self.size == 1:
            out = features @ self.kernel
        else:
            assert pairs is not None, "a kernel wider than 1 needs its pairs"
            out = convolve(features, self.kernel, pairs)
        return out if self.bias is None else out + self.bias


def convolve(features: Tensor, kernel: Tensor, pairs: KernelMap) -> Tensor:
    """Features (n_input, C) and a kernel (K^3, C, D) to (n_output, D)."""
    if features.shape[1] <= _FEW_CHANNELS:
        return _all_offsets(features, kernel, pairs)
    out: Tensor = _Convolution.apply(features, kernel, pairs)
    return out


def _all_offsets(features: Tensor, kernel: Tensor, pairs: KernelMap) -> Tensor:
    volume, dim_in, dim_out = kernel.shape
    counts = torch.tensor(pairs.counts, device=features.device)
    offset = torch.arange(volume, device=features.device).repeat_interleave(counts, output_size=len(pairs))
    columns = features.new_zeros(pairs.n_output * volume, dim_in)
    columns = columns.index_copy(0, pairs.output * volume + offset, features[pairs.input])
    return columns.view(pairs.n_output, volume * dim_in) @ kernel.reshape(volume * dim_in, dim_out)


class _Convolution(torch.autograd.Function):
    # torch would keep every gathered row for the gradient, and scatter row by row.
    @staticmethod
    def forward(ctx: Any, features: Tensor, kernel: Tensor, pairs: KernelMap) -> Tensor:
        ctx.save_for_backward(features, kernel)
        ctx.pairs = pairs
        return _sum(_products(features, kernel, pairs.input, pairs.counts), pairs.by_output)

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, Tensor | None, None]:
        (features, kernel), pairs = ctx.saved_tensors, ctx.pairs
        gradient = gradient.contiguous()
        of_features = of_kernel = None
        if ctx.needs_input_grad[0]:
            back = _products(gradient, kernel.transpose(1, 2), pairs.output, pairs.counts)
            of_features = _sum(back, pairs.by_input)
        if ctx.needs_input_grad[1]:
            of_kernel = torch.zeros_like(kernel)
            for k, part in enumerate(_parts(pairs.counts)):
                of_kernel[k] = features[pairs.input[part]].t() @ gradient[pairs.output[part]]
        return of_features, of_kernel, None


def _products(rows: Tensor, matrices: Tensor, index: Tensor, counts: tuple[int, ...]) -> Tensor:
    out = rows.new_empty(len(index), matrices.shape[2])
    for k, part in enumerate(_parts(counts)):
        if counts[k]:
            torch.mm(rows.index_select(0, index[part]), matrices[k], out=out[part])
    return out


def _parts(counts: tuple[int, ...]) -> list[slice]:
    return [slice(end - count, end) for count, end in zip(counts, accumulate(counts), strict=True)]


def _sum(rows: Tensor, bags: tuple[Tensor, Tensor]) -> Tensor:
    if len(rows) == 0:
        return rows.new_zeros(len(bags[1]), rows.shape[1])
    return F.embedding_bag(bags[0], rows, bags[1], mode="sum")
