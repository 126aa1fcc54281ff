# SPDX-License-Identifier: MIT
"""KPFCNN: the encoder and decoder of Predator and CoFiNet (Thomas et al. 2019, as D3Feat changed it).

As in its code, the first unary layer of a residual block and that of its shortcut are left out where widths agree, each
normalisation runs over the points of both clouds, and no layer but the heads has a bias.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from torch import Tensor, nn

from hybridreg.learned.geotransformer.kpconv_fpn import plain_surroundings, strided_surroundings
from hybridreg.learned.kpfcnn.kpfcnn_config import KpfcnnConfig
from hybridreg.learned.layers.kpconv_blocks import (
    ConvBlock,
    ResidualBlock,
    Surroundings,
    Unary,
    linear_on_joined,
)
from hybridreg.learned.pyramid.point_pyramid import Pyramid


class KpfcnnEncoder(nn.Module):
    """From the first stage to the coarsest. ``seed`` fixes the rotation of each layer's kernel points."""

    def __init__(self, config: KpfcnnConfig, seed: int = 0) -> None:
        super().__init__()
        self.config = config
        rng = np.random.default_rng(seed)
        self.blocks = nn.ModuleList(
            ConvBlock(block.plan, rng) if block.simple else ResidualBlock(block.plan, rng)
            for block in config.encoder()
        )

    def forward(self, features: Tensor, pyramid: Pyramid) -> tuple[Tensor, list[Tensor]]:
        """Features (N_1, 1) to those of the superpoints (N_S, C), and of each finer stage where the next begins."""
        skips: list[Tensor] = []
        plain: Surroundings | None = None
        for block, module in zip(self.config.encoder(), self.blocks, strict=True):
            if block.plan.strided:
                skips.append(features)
                plain, around = None, strided_surroundings(pyramid, block.stage, exact=True)
            else:
                plain = around = plain or plain_surroundings(pyramid, block.stage, exact=True)
            features = module(features, around)
        return features, skips


class KpfcnnDecoder(nn.Module):
    """From the superpoints back to the first stage.

    Each unary layer halves the width that the decoder was given, and takes the skip's features after the upsampled
    ones. The last is a linear layer alone, to ``dim_out``, or to the next half where that is None.
    """

    def __init__(self, config: KpfcnnConfig, dim_in: int, dim_out: int | None = None) -> None:
        super().__init__()
        self.config = config
        self.blocks = nn.ModuleDict()
        dim, width, stage, joins = dim_in, dim_in, config.stages - 1, False
        for index, block in enumerate(config.decoding):
            if block == "nearest_upsample":
                width, stage, joins = width // 2, stage - 1, True
                continue
            dim = dim + config.skip_dims[stage] if joins else dim
            if block == "unary":
                self.blocks[str(index)] = Unary(dim, width, None, False)
            else:
                self.blocks[str(index)] = nn.Linear(dim, dim_out or width, bias=False)
            dim, joins = width, False

    @property
    def dim_out(self) -> int:
        """Width of the output."""
        return _linear(list(self.blocks.values())[-1]).out_features

    def forward(self, features: Tensor, skips: list[Tensor], pyramid: Pyramid) -> Tensor:
        """Superpoint features (N_S, dim_in) and the encoder's skips to (N_1, dim_out)."""
        for _, out in self.steps(features, skips, pyramid):
            features = out
        return features

    def steps(self, features: Tensor, skips: list[Tensor], pyramid: Pyramid) -> Iterator[tuple[int, Tensor]]:
        """Index in the list of the decoder's blocks, and output, of each layer."""
        stage, joins = pyramid.stages - 1, False
        for index, block in enumerate(self.config.decoding):
            if block == "nearest_upsample":
                stage, joins = stage - 1, True
                continue
            layer = self.blocks[str(index)]
            linear = _linear(layer)
            if joins:
                features = linear_on_joined(linear, features, pyramid.upsampling[stage], skips[stage])
            else:
                features = linear(features)
            if isinstance(layer, Unary):
                features = layer.normalize(features, pyramid.lengths[stage])
            joins = False
            yield index, features


def _linear(layer: nn.Module) -> nn.Linear:
    linear = layer.linear if isinstance(layer, Unary) else layer
    assert isinstance(linear, nn.Linear)
    return linear
