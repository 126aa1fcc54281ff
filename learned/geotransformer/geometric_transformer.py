# SPDX-License-Identifier: MIT
"""The GeoTransformer block: alternating geometric self-attention and cross-attention (docs/methods.md 6.6)."""

from __future__ import annotations

from torch import Tensor, nn

from hybridreg.learned.cross3dreg.config import TransformerConfig
from hybridreg.learned.geotransformer.structure_embedding import StructureEmbedding
from hybridreg.learned.layers.attention import AttentionLayer, Structure


class GeoTransformerBlock(nn.Module):
    """Exchange features within and between the clouds; vanilla self-attention uses no geometry."""

    def __init__(self, config: TransformerConfig) -> None:
        super().__init__()
        self.kinds = config.blocks
        geometric = config.self_attention == "geometric"
        dim = config.hidden_dim
        self.embedding = (
            StructureEmbedding(dim, config.sigma_d, config.sigma_a, config.angle_k) if geometric else None
        )
        self.layers = nn.ModuleList(
            AttentionLayer(dim, config.heads, geometric=geometric and kind == "self")
            for kind in config.blocks
        )
        self.out = nn.Linear(dim, config.output_dim)

    def forward(
        self, target: Tensor, source: Tensor, target_points: Tensor, source_points: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Features (m, d), (n, d) at positions (m, 3), (n, 3) to (m, out), (n, out)."""
        # All self layers share one embedding a cloud: it is the largest tensor of the network.
        structures: tuple[Tensor | Structure | None, ...] = (None, None)
        if self.embedding is not None:
            structures = (self.embedding.table(target_points), self.embedding.table(source_points))
        for kind, layer in zip(self.kinds, self.layers, strict=True):
            if kind == "self":
                target = layer(target, target, structures[0])
                source = layer(source, source, structures[1])
            else:
                # In this order: the source attends to the target that has already attended to the source.
                target = layer(target, source)
                source = layer(source, target)
        return self.out(target), self.out(source)
