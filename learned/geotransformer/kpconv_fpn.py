# SPDX-License-Identifier: MIT
"""KPConv-FPN: an encoder over the stages of a pyramid and a decoder back to the fine stage (docs/methods.md 3.4)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from torch import Tensor, nn

from hybridreg.learned.cross3dreg.config import BackboneConfig
from hybridreg.learned.layers.dense_influence import DenseLinks
from hybridreg.learned.layers.influence import Links, find_links
from hybridreg.learned.layers.kpconv_blocks import (
    BlockPlan,
    ConvBlock,
    ResidualBlock,
    Surroundings,
    Unary,
    linear_on_joined,
)
from hybridreg.learned.pyramid.point_pyramid import Pyramid


class KpconvFpn(nn.Module):
    """Encoder and decoder of any number of stages from one description.

    Stage 1 has a convolution and a residual block, every later stage a strided and two plain residual blocks;
    widths double with the stage. The decoder stops at the fine stage. ``seed`` fixes the kernel points' rotations.
    """

    def __init__(self, config: BackboneConfig, seed: int = 0) -> None:
        super().__init__()
        self.config = config
        rng = None if config.shared_kernel_points else np.random.default_rng(seed)
        self.encoder = nn.ModuleList(
            nn.ModuleList(_block(plan, first=stage == 0 and i == 0, rng=rng) for i, plan in enumerate(plans))
            for stage, plans in enumerate(block_plans(config))
        )
        self.decoder = nn.ModuleDict()
        for stage in range(config.stages - 2, config.fine_stage - 1, -1):
            dim = config.init_dim * 2 ** (stage + 1)
            per_cloud = config.norm_scope == "per_cloud"
            self.decoder[str(stage)] = Unary(3 * dim, dim, config.groups, per_cloud)
        fine_in = 3 * config.init_dim * 2**config.fine_stage
        self.decoder[str(config.fine_stage - 1)] = nn.Linear(fine_in, config.fine_dim)

    def forward(self, features: Tensor, pyramid: Pyramid) -> tuple[Tensor, Tensor]:
        """Features of the superpoints and of the fine points, target first.

        Parameters
        ----------
        features
            (N_1, C_in) of the first stage's points.

        Returns
        -------
        coarse, fine
            (N_S, init_dim * 2**stages) and (N_fine, fine_dim).
        """
        skips = []
        for stage, blocks in enumerate(self.encoder):
            assert isinstance(blocks, nn.ModuleList)
            features = self._encode_stage(features, pyramid, stage, blocks)
            skips.append(features)
        coarse = features
        for stage in range(self.config.stages - 2, self.config.fine_stage - 2, -1):
            layer = self.decoder[str(stage)]
            linear = layer.linear if isinstance(layer, Unary) else layer
            features = linear_on_joined(linear, features, pyramid.upsampling[stage], skips[stage])
            if isinstance(layer, Unary):
                features = layer.normalize(features, pyramid.lengths[stage])
        return coarse, features

    def _encode_stage(self, features: Tensor, pyramid: Pyramid, stage: int, blocks: nn.ModuleList) -> Tensor:
        cylindrical = self.config.kernel == "cylindrical"
        plain = plain_surroundings(pyramid, stage, cylindrical)
        if self.config.shared_kernel_points:
            plain = _with_influence(plain, blocks[-1])
        for index, block in enumerate(blocks):
            strided = stage > 0 and index == 0
            features = block(
                features, strided_surroundings(pyramid, stage, cylindrical) if strided else plain
            )
        return features


def block_plans(config: BackboneConfig) -> list[list[BlockPlan]]:
    """The blocks of each stage: the plan of the whole encoder."""
    return [_stage_plans(config, stage) for stage in range(config.stages)]


def _stage_plans(config: BackboneConfig, stage: int) -> list[BlockPlan]:
    def plan(dim_in: int, dim_out: int, scale: int, strided: bool = False) -> BlockPlan:
        return BlockPlan(
            dim_in=dim_in,
            dim_out=dim_out,
            radius=config.radius(scale),
            sigma=config.sigma(scale),
            groups=config.groups,
            per_cloud=config.norm_scope == "per_cloud",
            n_kernel=config.kernel_points,
            cylindrical=config.kernel == "cylindrical",
            strided=strided,
        )

    dim = config.init_dim * 2**stage
    if stage == 0:
        return [plan(config.input_dim, dim, 0), plan(dim, 2 * dim, 0)]
    # A strided block queries the finer stage from the coarse points, with the finer stage's radius.
    return [plan(dim, dim, stage - 1, True), plan(dim, 2 * dim, stage), plan(2 * dim, 2 * dim, stage)]


def _block(plan: BlockPlan, first: bool, rng: np.random.Generator | None) -> nn.Module:
    return ConvBlock(plan, rng) if first else ResidualBlock(plan, rng)


def plain_surroundings(
    pyramid: Pyramid, stage: int, cylindrical: bool = False, *, exact: bool = False
) -> Surroundings:
    """Neighbourhoods of a stage's points within the stage; stages count from 0."""
    points, lengths, neighbors = pyramid.points[stage], pyramid.lengths[stage], pyramid.neighbors[stage]
    links = _links(points, points, neighbors, cylindrical, exact)
    return Surroundings(neighbors, lengths, lengths, links)


def strided_surroundings(
    pyramid: Pyramid, stage: int, cylindrical: bool = False, *, exact: bool = False
) -> Surroundings:
    """Neighbourhoods of a stage's points in the finer stage before it."""
    neighbors = pyramid.subsampling[stage - 1]
    return Surroundings(
        neighbors,
        lengths=pyramid.lengths[stage],
        support_lengths=pyramid.lengths[stage - 1],
        links=_links(pyramid.points[stage], pyramid.points[stage - 1], neighbors, cylindrical, exact),
    )


def _links(
    queries: Tensor, supports: Tensor, neighbors: Tensor, cylindrical: bool, exact: bool
) -> Links | DenseLinks:
    if queries.is_cuda:
        return DenseLinks.find(queries, supports, neighbors, cylindrical=cylindrical)
    return find_links(queries, supports, neighbors, cylindrical=cylindrical, exact=exact)


def _with_influence(around: Surroundings, block: nn.Module) -> Surroundings:
    assert isinstance(block, ConvBlock | ResidualBlock)
    return replace(around, influence=around.influence_of(block.conv))
