# SPDX-License-Identifier: MIT
"""The blocks of KPConv-FPN: normalisation, unary layers, convolution and residual blocks (docs/methods.md 3.3)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.layers.dense_influence import DenseInfluence, DenseLinks
from hybridreg.learned.layers.group_norm import group_norm
from hybridreg.learned.layers.influence import Influence, Links
from hybridreg.learned.layers.kernel_points import cylindrical_kernel_points, kernel_points
from hybridreg.learned.layers.kpconv import KPConv
from hybridreg.learned.layers.max_pool import max_pool

_SLOPE = 0.1


@dataclass(frozen=True)
class Surroundings:
    """The geometry that a block needs: its queries, supports and links."""

    neighbors: Tensor  # (N, k) into the supports, pad M
    lengths: tuple[int, ...]  # queries of each cloud
    support_lengths: tuple[int, ...]
    links: Links | DenseLinks
    influence: Influence | DenseInfluence | None = None  # where the layers share their kernel points

    def influence_of(self, conv: KPConv) -> Influence | DenseInfluence:
        """Influences of the neighbours on a layer's kernel points."""
        return self.influence or self.links.influence(conv.kernel, conv.sigma)


class PointGroupNorm(nn.Module):
    """Group normalisation of (N, C) features over all points, or over each cloud apart."""

    def __init__(self, dim: int, groups: int, per_cloud: bool) -> None:
        super().__init__()
        self.groups, self.per_cloud = groups, per_cloud
        self.weight = nn.Parameter(torch.ones(dim))
        self.bias = nn.Parameter(torch.zeros(dim))

    def forward(self, features: Tensor, lengths: tuple[int, ...], slope: float = 1.0) -> Tensor:
        """(N, C) to (N, C); ``lengths`` splits the rows into clouds, ``slope`` is a LeakyReLU's."""
        clouds = lengths if self.per_cloud else (len(features),)
        return group_norm(features, clouds, self.weight, self.bias, self.groups, slope)


class PointInstanceNorm(nn.Module):
    """Instance normalisation of (N, C) features, each channel apart, over all points of both clouds; no weights.

    So a cloud's features depend on the other cloud. Predator's and CoFiNet's code calls it batch normalisation; it
    keeps no statistics, and training and evaluation compute the same.
    """

    def forward(self, features: Tensor, lengths: tuple[int, ...], slope: float = 1.0) -> Tensor:
        """(N, C) to (N, C); ``slope`` is a LeakyReLU's."""
        dim = features.shape[1]
        return group_norm(
            features, (len(features),), features.new_ones(dim), features.new_zeros(dim), dim, slope
        )


def point_norm(dim: int, groups: int | None, per_cloud: bool) -> PointGroupNorm | PointInstanceNorm:
    """Group normalisation, or where there are no groups instance normalisation of the stacked clouds."""
    return PointInstanceNorm() if groups is None else PointGroupNorm(dim, groups, per_cloud)


class Unary(nn.Module):
    """Linear layer, normalisation, and LeakyReLU unless ``activate`` is false.

    ``groups`` None means instance normalisation and no bias, which it would remove again.
    """

    def __init__(
        self, dim_in: int, dim_out: int, groups: int | None, per_cloud: bool, *, activate: bool = True
    ) -> None:
        super().__init__()
        self.activate = activate
        self.linear = nn.Linear(dim_in, dim_out, bias=groups is not None)
        self.norm = point_norm(dim_out, groups, per_cloud)

    def forward(self, features: Tensor, lengths: tuple[int, ...]) -> Tensor:
        """(N, C_in) to (N, C_out)."""
        return self.normalize(self.linear(features), lengths)

    def normalize(self, features: Tensor, lengths: tuple[int, ...]) -> Tensor:
        """What follows the linear layer, (N, C_out) to (N, C_out)."""
        return self.norm(features, lengths, _SLOPE if self.activate else 1.0)


@dataclass(frozen=True, kw_only=True)
class BlockPlan:
    """One block of the encoder."""

    dim_in: int
    dim_out: int
    radius: float
    sigma: float
    groups: int | None  # of group normalisation; None: instance normalisation and no biases
    per_cloud: bool
    n_kernel: int
    cylindrical: bool = False
    strided: bool = False

    def kernel(self, rng: np.random.Generator | None) -> npt.NDArray[np.float32]:
        """(n_kernel, 3) kernel points in metres; ``rng`` turns spatial ones."""
        if self.cylindrical:
            return cylindrical_kernel_points(self.n_kernel, self.radius)
        return kernel_points(self.n_kernel, self.radius, rng)

    def convolution(self, dim_in: int, dim_out: int, rng: np.random.Generator | None) -> KPConv:
        """The block's convolution."""
        return KPConv(dim_in, dim_out, self.sigma, self.kernel(rng), bias=self.groups is not None)


class ConvBlock(nn.Module):
    """KPConv, normalisation, LeakyReLU."""

    def __init__(self, plan: BlockPlan, rng: np.random.Generator | None) -> None:
        super().__init__()
        self.conv = plan.convolution(plan.dim_in, plan.dim_out, rng)
        self.norm = point_norm(plan.dim_out, plan.groups, plan.per_cloud)

    def forward(self, features: Tensor, around: Surroundings) -> Tensor:
        """(M, C_in) to (N, C_out)."""
        features = self.conv(features, around.neighbors, around.influence_of(self.conv))
        return self.norm(features, around.lengths, _SLOPE)


class ResidualBlock(nn.Module):
    """Bottleneck of unary, KPConv and unary, beside a shortcut, max-pooled where the block is strided."""

    def __init__(self, plan: BlockPlan, rng: np.random.Generator | None) -> None:
        super().__init__()
        groups, per_cloud = plan.groups, plan.per_cloud
        middle = plan.dim_out // 4
        self.strided = plan.strided
        self.unary_in = Unary(plan.dim_in, middle, groups, per_cloud) if plan.dim_in != middle else None
        self.conv = plan.convolution(middle, middle, rng)
        self.norm = point_norm(middle, groups, per_cloud)
        self.unary_out = Unary(middle, plan.dim_out, groups, per_cloud, activate=False)
        widens = plan.dim_in != plan.dim_out
        self.unary_shortcut = (
            Unary(plan.dim_in, plan.dim_out, groups, per_cloud, activate=False) if widens else None
        )

    def forward(self, features: Tensor, around: Surroundings) -> Tensor:
        """(M, C_in) to (N, C_out)."""
        main = features if self.unary_in is None else self.unary_in(features, around.support_lengths)
        main = self.conv(main, around.neighbors, around.influence_of(self.conv))
        main = self.unary_out(self.norm(main, around.lengths, _SLOPE), around.lengths)
        shortcut = max_pool(features, around.neighbors) if self.strided else features
        if self.unary_shortcut is not None:
            shortcut = self.unary_shortcut(shortcut, around.lengths)
        return F.leaky_relu_(main + shortcut, _SLOPE)


def linear_on_joined(layer: nn.Module, coarse: Tensor, nearest: Tensor, skip: Tensor) -> Tensor:
    """A linear layer on upsampled coarse features (M, C) beside those of a skip (N, D), to (N, C_out).

    The coarse part is multiplied before it is upsampled: there are fewer coarse points.
    """
    assert isinstance(layer, nn.Linear)
    from_coarse, from_skip = layer.weight.split([coarse.shape[1], skip.shape[1]], dim=1)
    return F.linear(skip, from_skip, layer.bias) + upsample(coarse @ from_coarse.t(), nearest)


def upsample(features: Tensor, nearest: Tensor) -> Tensor:
    """Each point takes the features of its coarse point, (M, C) and (N,) to (N, C); padding gives 0."""
    return F.embedding(nearest, pad_row(features))


def pad_row(features: Tensor) -> Tensor:
    """Append a row of zeros, which the padding index refers to."""
    return torch.cat([features, features.new_zeros(1, features.shape[1])])
