# SPDX-License-Identifier: MIT
"""RoITr's global transformer: self-attention of two branches, features and positions, and cross-attention with both."""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

from hybridreg.learned.cross3dreg.config import TransformerConfig
from hybridreg.learned.geotransformer.structure_embedding import StructureEmbedding
from hybridreg.learned.layers.attention import Attention, FeedForward, merge_heads, split_heads


class TwoBranchAttention(Attention):
    """Geometric attention whose scores are used twice: for the features, and without the diagonal for positions."""

    def __init__(self, dim: int, heads: int) -> None:
        super().__init__(dim, heads, geometric=True)
        self.position_value = nn.Linear(dim, dim)

    def scores(self, features: Tensor, structure: Tensor) -> Tensor:
        """(n, d) with the structure embedding (n, n, d) to (h, n, n), before the softmax."""
        query = split_heads(self.query(features), self.heads)
        key = split_heads(self.key(features), self.heads)
        scores = query @ key.transpose(1, 2) + self._structure_scores(query, structure)
        return scores / math.sqrt(query.shape[2])

    def branches(self, features: Tensor, structure: Tensor) -> tuple[Tensor, Tensor]:
        """Attended features (n, d), and positions (n, d): the structure alone, of all points but the point itself."""
        scores = self.scores(features, structure)
        value = split_heads(self.value(features), self.heads)
        attended = merge_heads(torch.softmax(scores, dim=-1) @ value)
        return attended, self._positions(self._others(scores), structure)

    def _others(self, scores: Tensor) -> Tensor:
        n = scores.shape[1]
        if n == 1:  # there is no other point
            return torch.softmax(scores, dim=-1)
        itself = torch.eye(n, dtype=torch.bool, device=scores.device)
        return torch.softmax(scores.masked_fill(itself, -math.inf), dim=-1)

    def _positions(self, weights: Tensor, structure: Tensor) -> Tensor:
        # sum_j a_ij (W r_ij + b) = W (sum_j a_ij r_ij) + b: the n * m embeddings are not projected one by one.
        mean = weights.transpose(0, 1) @ structure  # (n, h, d)
        weight = self.position_value.weight.unflatten(0, (self.heads, -1))  # (h, c, d)
        return torch.einsum("nhd,hcd->nhc", mean, weight).flatten(1) + self.position_value.bias


class SelfLayer(nn.Module):
    """Both branches, each with its own linear, norm and feed-forward part; positions have no residual."""

    def __init__(self, dim: int, heads: int) -> None:
        super().__init__()
        self.attention = TwoBranchAttention(dim, heads)
        self.linear, self.norm, self.feed_forward = nn.Linear(dim, dim), nn.LayerNorm(dim), FeedForward(dim)
        self.position_linear, self.position_norm = nn.Linear(dim, dim), nn.LayerNorm(dim)
        self.position_feed_forward = FeedForward(dim)

    def forward(self, features: Tensor, structure: Tensor) -> tuple[Tensor, Tensor]:
        """(n, d), (n, n, d) to features (n, d) and positions (n, d)."""
        attended, positions = self.attention.branches(features, structure)
        features = self.feed_forward(self.norm(self.linear(attended) + features))
        positions = self.position_norm(self.position_linear(positions))
        return features, self.position_feed_forward(positions)


class CrossLayer(nn.Module):
    """Positions of the self layer before are added to queries and keys, not to values, nor to the residual."""

    def __init__(self, dim: int, heads: int) -> None:
        super().__init__()
        self.attention = Attention(dim, heads)
        self.linear, self.norm, self.feed_forward = nn.Linear(dim, dim), nn.LayerNorm(dim), FeedForward(dim)

    def forward(
        self, features: Tensor, positions: Tensor, memory: Tensor, memory_positions: Tensor
    ) -> Tensor:
        """(n, d) attends to (m, d)."""
        attended = self.attention(features + positions, memory + memory_positions, values=memory)
        return self.feed_forward(self.norm(self.linear(attended) + features))


class GlobalTransformer(nn.Module):
    """Superpoints of both clouds. The embedding is GeoTransformer's: neither normals nor point-pair features."""

    def __init__(self, in_dim: int, config: TransformerConfig) -> None:
        super().__init__()
        dim = config.hidden_dim
        self.kinds = config.blocks
        self.embedding = StructureEmbedding(dim, config.sigma_d, config.sigma_a, config.angle_k)
        self.in_proj = nn.Linear(in_dim, dim)
        self.layers = nn.ModuleList(
            SelfLayer(dim, config.heads) if kind == "self" else CrossLayer(dim, config.heads)
            for kind in config.blocks
        )
        self.out = nn.Linear(dim, config.output_dim)

    def forward(
        self, source: Tensor, target: Tensor, source_points: Tensor, target_points: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Features (n, c), (m, c) at (n, 3), (m, 3) to (n, out), (m, out): source first, unlike GeoTransformer."""
        source, target = self.in_proj(source), self.in_proj(target)
        structures = self.embedding(source_points), self.embedding(target_points)
        positions = torch.zeros_like(source), torch.zeros_like(target)
        for kind, layer in zip(self.kinds, self.layers, strict=True):
            if kind == "self":
                source, source_positions = layer(source, structures[0])
                target, target_positions = layer(target, structures[1])
                positions = source_positions, target_positions
            else:
                # In this order: the target attends to the source that has already attended to the target.
                source = layer(source, positions[0], target, positions[1])
                target = layer(target, positions[1], source, positions[0])
        return self.out(source), self.out(target)
