# SPDX-License-Identifier: MIT
"""Visual-geometric attention (VGAM): superpoints attend to the image, then to their own cloud (docs/methods.md 6.1 to
6.5)."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from hybridreg.learned.cross3dreg.config import VgamConfig
from hybridreg.learned.cross3dreg.image_encoder import ImageFeatures, pool_tokens
from hybridreg.learned.layers.attention import (
    Attention,
    AttentionLayer,
    FeedForward,
    merge_heads,
    split_heads,
)
from hybridreg.learned.layers.positions import PointPosition, image_grid_encoding


class VisualAttention(nn.Module):
    """``softmax((Q + E)(K + G)^T / sqrt(c)) (V + G)``: positions enter score and value (docs/methods.md 6.3).

    c is the width of a head, or ``scale``; ``mix`` false leaves out the linear layer behind the heads.
    """

    def __init__(self, dim: int, heads: int, *, scale: int | None = None, mix: bool = True) -> None:
        super().__init__()
        self.heads = heads
        self.scale = math.sqrt(dim // heads if scale is None else scale)
        self.query, self.key, self.value = nn.Linear(dim, dim), nn.Linear(dim, dim), nn.Linear(dim, dim)
        self.point, self.pixel = nn.Linear(dim, dim), nn.Linear(dim, dim)
        self.linear = nn.Linear(dim, dim) if mix else nn.Identity()

    def forward(self, features: Tensor, tokens: Tensor, at_points: Tensor, at_tokens: Tensor) -> Tensor:
        """Features (n, d) and tokens (L, d) with their encodings (n, d), (L, d) to (n, d)."""
        pixel = self.pixel(at_tokens)
        query = split_heads(self.query(features) + self.point(at_points), self.heads)
        key = split_heads(self.key(tokens) + pixel, self.heads)
        weights = torch.softmax(query @ key.transpose(1, 2) / self.scale, dim=-1)
        mixed: Tensor = self.linear(
            merge_heads(weights @ split_heads(self.value(tokens) + pixel, self.heads))
        )
        return mixed


class GatedResidual(nn.Module):
    """``x + g * f(x)`` with ``g`` learned from 0: added to trained weights it changes nothing at first."""

    def __init__(self, dim: int) -> None:
        super().__init__()
        self.gate = nn.Parameter(torch.zeros(dim))

    def forward(self, features: Tensor, change: Tensor) -> Tensor:
        """(n, d), (n, d) to (n, d)."""
        return features + self.gate * change


class NormedResidual(nn.Module):
    """``LN(x + f(x))``."""

    def __init__(self, dim: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(dim)

    def forward(self, features: Tensor, change: Tensor) -> Tensor:
        """(n, d), (n, d) to (n, d)."""
        return self.norm(features + change)


class VisualLayer(nn.Module):
    """Visual cross-attention, then vanilla self-attention, each followed by a two-layer network."""

    def __init__(self, dim: int, heads: int, gated: bool) -> None:
        super().__init__()
        self.gated = gated
        residual = GatedResidual if gated else NormedResidual
        self.visual = VisualAttention(dim, heads)
        self.visual_residual = residual(dim)
        if gated:
            self.self_attention: nn.Module = Attention(dim, heads)
            self.self_residual = GatedResidual(dim)
        else:
            self.visual_feed_forward = FeedForward(dim)
            self.self_attention = AttentionLayer(dim, heads)

    def forward(self, features: Tensor, tokens: Tensor, at_points: Tensor, at_tokens: Tensor) -> Tensor:
        """(n, d) to (n, d)."""
        change = self.visual(features, tokens, at_points, at_tokens)
        features = self.visual_residual(features, change)
        if self.gated:
            return self.self_residual(features, self.self_attention(features, features))
        features = self.visual_feed_forward(features)
        return self.self_attention(features, features)


class PrintedLayer(nn.Module):
    """The paper's equations and nothing else: ``F' = S (V + G) + F``, then ``F'' = softmax(Q K^T / sqrt(d')) V + F'``,
    where d' is the width of the fine features."""

    def __init__(self, dim: int, heads: int, fine_dim: int) -> None:
        super().__init__()
        self.visual = VisualAttention(dim, heads, scale=fine_dim, mix=False)
        self.self_attention = Attention(dim, heads, scale=fine_dim)

    def forward(self, features: Tensor, tokens: Tensor, at_points: Tensor, at_tokens: Tensor) -> Tensor:
        """(n, d) to (n, d)."""
        seen: Tensor = self.visual(features, tokens, at_points, at_tokens) + features
        return self.self_attention(seen, seen) + seen


class VisualGeometricAttention(nn.Module):
    """N repeats of the visual layer on each cloud, the weights shared by both.

    ``fine_dim`` is the width of the fine features; the paper's text scales by it.
    """

    def __init__(self, config: VgamConfig, dim: int, image_dim: int, fine_dim: int) -> None:
        super().__init__()
        self.pool = config.pool
        self.token = nn.Linear(image_dim, dim)
        self.position = PointPosition(dim, config.point_position)
        self.layers = nn.ModuleList(
            PrintedLayer(dim, config.heads, fine_dim)
            if config.formula == "text"
            else VisualLayer(dim, config.heads, config.gated)
            for _ in range(config.repeats)
        )

    def forward(self, features: Tensor, points: Tensor, image: ImageFeatures) -> Tensor:
        """Features (n, d) at points (n, 3), metres, in the sensor's frame, to (n, d)."""
        tokens, at_tokens = self._tokens(image)
        at_points = self.position(points)
        for layer in self.layers:
            features = layer(features, tokens, at_points, at_tokens)
        return features

    def _tokens(self, image: ImageFeatures) -> tuple[Tensor, Tensor]:
        if image.grid is None:
            token = self.token(image.null)
            return token, torch.zeros_like(token)
        tokens, height, width = pool_tokens(image.grid, self.pool)
        tokens = self.token(tokens)
        return tokens, image_grid_encoding(height, width, tokens.shape[1], tokens.device).to(tokens.dtype)
