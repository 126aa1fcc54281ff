# SPDX-License-Identifier: MIT
"""Self-, cross- and self-attention and a projection: for the superpoints, and again for each pair of patches."""

from __future__ import annotations

from collections.abc import Iterator

from torch import Tensor, nn

from hybridreg.learned.layers.message_attention import Clouds, Masks, MessageBlock


class PairTransformer(nn.Module):
    """Three blocks with residuals and without positions, then one linear layer for both sides."""

    def __init__(self, dim: int, heads: int) -> None:
        super().__init__()
        self.blocks = nn.ModuleList(MessageBlock(kind, dim, heads) for kind in ("self", "cross", "self"))
        self.project = nn.Linear(dim, dim)

    def forward(self, clouds: Clouds, masks: Masks = (None, None)) -> Clouds:
        """Features (..., n, d), (..., m, d) of source and target, of which ``masks`` may exclude rows."""
        return list(self.steps(clouds, masks))[-1]

    def steps(self, clouds: Clouds, masks: Masks = (None, None)) -> Iterator[Clouds]:
        """Features after each block, and after the projection."""
        for block in self.blocks:
            clouds = block(clouds, masks)
            yield clouds
        yield self.project(clouds[0]), self.project(clouds[1])


def scores(clouds: Clouds) -> Tensor:
    """(..., n, d), (..., m, d) to (..., n, m): inner products over the root of the width."""
    source, target = clouds
    product: Tensor = source @ target.transpose(-1, -2) / source.shape[-1] ** 0.5
    return product
