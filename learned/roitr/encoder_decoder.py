# SPDX-License-Identifier: MIT
"""RoITr's encoder and decoder: local attention on every level, farthest points down, interpolation up."""

from __future__ import annotations

from dataclasses import dataclass
from typing import cast

import torch
from torch import Tensor, nn

from hybridreg.learned.roitr.config import RoitrConfig
from hybridreg.learned.roitr.local_attention import LocalAttention, LocalBlock
from hybridreg.learned.roitr.pair_features import pair_features
from hybridreg.learned.roitr.point_levels import Levels

_EPS = 1e-8  # metres; keeps the inverse distance finite where two levels share a point


@dataclass(frozen=True)
class LevelFeatures:
    """Point-pair features of a cloud, computed once for all blocks and for the decoder."""

    within: tuple[Tensor, ...]  # (N_l, k, 4)
    down: tuple[Tensor, ...]  # (N_l, k, 4), for l > 0

    @classmethod
    @torch.no_grad()
    def of(cls, levels: Levels) -> LevelFeatures:
        """From points and normals."""
        clouds = list(zip(levels.points, levels.normals, strict=True))
        within = [
            pair_features(p, n, p[rows], n[rows])
            for (p, n), rows in zip(clouds, levels.neighbors, strict=True)
        ]
        down = [
            pair_features(p, n, finer[rows], finer_normals[rows])
            for (p, n), (finer, finer_normals), rows in zip(clouds[1:], clouds[:-1], levels.down, strict=True)
        ]
        return cls(tuple(within), tuple(down))


class EncoderLevel(nn.Module):
    """The abstraction layer from the finer level, then attention blocks; no norm, activation or skip between."""

    def __init__(self, in_dim: int, dim: int, hidden: int, heads: int, blocks: int) -> None:
        super().__init__()
        self.abstraction = LocalAttention(in_dim, hidden, dim, heads)
        self.blocks = nn.ModuleList(LocalBlock(dim, hidden, heads) for _ in range(blocks - 1))

    def refine(self, features: Tensor, neighbors: Tensor, ppf: Tensor) -> Tensor:
        """The blocks alone: (N, C) to (N, C)."""
        for block in self.blocks:
            features = block(features, neighbors, ppf)
        return features


class Head(nn.Module):
    """The decoder's coarsest step: each point beside a projection of the cloud's mean."""

    def __init__(self, dim: int) -> None:
        super().__init__()
        self.linear, self.norm, self.mean = nn.Linear(2 * dim, dim), nn.LayerNorm(dim), nn.Linear(dim, dim)

    def forward(self, features: Tensor) -> Tensor:
        """(N, C) to (N, C)."""
        mean = torch.relu(self.mean(features.mean(0, keepdim=True))).expand_as(features)
        return torch.relu(self.norm(self.linear(torch.cat([features, mean], 1))))


class StepUp(nn.Module):
    """Normed features of a level plus normed coarser ones, interpolated by inverse distance (not squared)."""

    def __init__(self, dim: int, coarse_dim: int) -> None:
        super().__init__()
        self.linear, self.norm = nn.Linear(dim, dim), nn.LayerNorm(dim)
        self.coarse_linear, self.coarse_norm = nn.Linear(coarse_dim, dim), nn.LayerNorm(dim)

    def forward(self, features: Tensor, coarse: Tensor, rows: Tensor, distance: Tensor) -> Tensor:
        """Features (N, C) and coarser ones (M, D), with rows (N, j) into these and distances (N, j), to (N, C)."""
        coarse = torch.relu(self.coarse_norm(self.coarse_linear(coarse)))
        weight = 1.0 / (distance + _EPS)
        weight = weight / weight.sum(1, keepdim=True)
        own = torch.relu(self.norm(self.linear(features)))
        return own + (coarse[rows] * weight[:, :, None]).sum(1)


class DecoderLevel(nn.Module):
    """A step up and one attention block."""

    def __init__(self, dim: int, coarse_dim: int | None, hidden: int, heads: int) -> None:
        super().__init__()
        self.up: Head | StepUp = Head(dim) if coarse_dim is None else StepUp(dim, coarse_dim)
        self.block = LocalBlock(dim, hidden, heads)


class RoitrBackbone(nn.Module):
    """Features of one cloud. The decoder sees only the encoder's features: fine features do not depend on the other
    cloud."""

    def __init__(self, config: RoitrConfig) -> None:
        super().__init__()
        before = (1, *config.widths[:-1])
        self.encoder = nn.ModuleList(
            EncoderLevel(in_dim, dim, hidden, config.heads, blocks)
            for in_dim, dim, hidden, blocks in zip(
                before, config.widths, config.inner, config.blocks, strict=True
            )
        )
        above = (*config.widths[1:], None)
        self.decoder = nn.ModuleList(
            DecoderLevel(dim, coarse_dim, hidden, config.decoder_heads)
            for dim, coarse_dim, hidden in zip(config.widths, above, config.inner, strict=True)
        )

    def forward(self, levels: Levels) -> tuple[Tensor, Tensor]:
        """Features (n, C) of the coarsest level and (N, c) of the finest; the input features are ones."""
        ppf = LevelFeatures.of(levels)
        encoded = self.encode(levels, ppf)
        return encoded[-1], self.decode(encoded, levels, ppf)

    def encode(self, levels: Levels, ppf: LevelFeatures) -> list[Tensor]:
        """Features (N_l, C_l) of every level."""
        features = levels.points[0].new_ones(len(levels.points[0]), 1)
        encoded: list[Tensor] = []
        for level in range(len(self.encoder)):
            features = self.abstract(level, features, levels, ppf)
            features = self._encoder(level).refine(features, levels.neighbors[level], ppf.within[level])
            encoded.append(features)
        return encoded

    def abstract(self, level: int, finer: Tensor, levels: Levels, ppf: LevelFeatures) -> Tensor:
        """The abstraction layer of a level alone, from the finer level's features; level 0 begins with one too."""
        layer = self._encoder(level).abstraction
        if level == 0:
            return layer(finer, None, levels.neighbors[0], ppf.within[0])
        return layer(finer, levels.picked[level - 1], levels.down[level - 1], ppf.down[level - 1])

    def decode(self, encoded: list[Tensor], levels: Levels, ppf: LevelFeatures) -> Tensor:
        """Features (N, c) of the finest level from the encoder's."""
        features = None
        for level in reversed(range(len(self.decoder))):
            features = self.step_up(level, encoded[level], features, levels)
            features = self._decoder(level).block(features, levels.neighbors[level], ppf.within[level])
        assert features is not None
        return features

    def step_up(self, level: int, encoded: Tensor, coarse: Tensor | None, levels: Levels) -> Tensor:
        """The decoder's way up to a level, before its attention block."""
        up = self._decoder(level).up
        if coarse is None:
            return up(encoded)
        return up(encoded, coarse, levels.up[level], levels.up_distance[level])

    def _encoder(self, level: int) -> EncoderLevel:
        return cast(EncoderLevel, self.encoder[level])

    def _decoder(self, level: int) -> DecoderLevel:
        return cast(DecoderLevel, self.decoder[level])
