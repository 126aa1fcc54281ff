# SPDX-License-Identifier: MIT
"""The overlapping mask predictor (OMP): which superpoints lie in the overlap (docs/methods.md 5.1)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from hybridreg.learned.cross3dreg import superpoint_evidence
from hybridreg.learned.cross3dreg.config import OmpConfig
from hybridreg.learned.cross3dreg.image_encoder import ImageFeatures, pool_tokens
from hybridreg.learned.layers.attention import Attention, AttentionLayer
from hybridreg.learned.layers.positions import image_grid_encoding


@dataclass(frozen=True)
class OverlapLogits:
    """Logits of the overlap probability of every superpoint."""

    target: Tensor  # (m,)
    source: Tensor  # (n,)
    informed: bool  # false: neither an image nor the other cloud was available


class OverlapPredictor(nn.Module):
    """Superpoint features query the image's tokens; one probability each. Both clouds share the weights.

    ``formula="figure"`` is the paper's drawing (a post-norm transformer block), ``"text"`` its equation
    ``MLP(A + FFN(A + X))``, in which no LayerNorm stands. ``cross_cloud`` lets each cloud look at the other first,
    without which there is nothing to go by when there is no image.
    """

    def __init__(self, config: OmpConfig, point_dim: int, image_dim: int) -> None:
        super().__init__()
        self.config = config
        dim = config.dim
        self.point = nn.Linear(point_dim + (superpoint_evidence.SIZE if config.evidence else 0), dim)
        self.point_norm = nn.LayerNorm(dim) if config.formula == "figure" else nn.Identity()
        self.cross = AttentionLayer(dim, config.heads) if config.cross_cloud else None
        self.token = nn.Conv2d(image_dim, dim, 3, padding=1)
        self.null = nn.Linear(image_dim, dim)
        self.value = nn.Linear(dim, dim)
        self.attention = Attention(dim, config.heads)
        self.attention_out = nn.Linear(dim, dim)
        self.norms = (
            nn.ModuleList(nn.LayerNorm(dim) for _ in range(2)) if config.formula == "figure" else None
        )
        self.expand, self.squeeze = nn.Linear(dim, 2 * dim), nn.Linear(2 * dim, dim)
        self.logit = nn.Linear(dim, 1)

    def forward(self, target: Tensor, source: Tensor, image: ImageFeatures) -> OverlapLogits:
        """Superpoint features (m, C), (n, C), with `evidence` followed by it, to logits (m,), (n,)."""
        target, source = self.point_norm(self.point(target)), self.point_norm(self.point(source))
        if self.cross is not None:
            target, source = self.cross(target, source), self.cross(source, target)
        tokens = self._tokens(image)
        informed = image.grid is not None or self.cross is not None
        return OverlapLogits(self._logits(target, tokens), self._logits(source, tokens), informed)

    def _tokens(self, image: ImageFeatures) -> Tensor:
        if image.grid is None:
            return self.null(image.null)
        tokens, height, width = pool_tokens(self.token(image.grid[None])[0], self.config.pool)
        if self.config.position == "sine":
            tokens = tokens + image_grid_encoding(height, width, tokens.shape[1], tokens.device)
        return tokens

    def _logits(self, points: Tensor, tokens: Tensor) -> Tensor:
        attended = self.attention_out(self.attention(points, tokens, values=self.value(tokens)))
        if self.norms is None:
            return self.logit(attended + self._feed_forward(attended + points))[:, 0]
        first = self.norms[0](attended + points)
        return self.logit(self.norms[1](first + self._feed_forward(first)))[:, 0]

    def _feed_forward(self, features: Tensor) -> Tensor:
        return self.squeeze(torch.relu(self.expand(features)))
