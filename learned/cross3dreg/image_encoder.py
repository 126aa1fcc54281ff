# SPDX-License-Identifier: MIT
"""The image encoder: a residual U-Net whose output gives the image tokens, or one null token (docs/methods.md 4)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.cross3dreg.config import ImageConfig


@dataclass(frozen=True)
class ImageFeatures:
    """Image features; without an image ``grid`` is None and ``null`` replaces all tokens."""

    grid: Tensor | None  # (d, h, w)
    null: Tensor  # (1, d)


class ResidualConv(nn.Module):
    """Two 3x3 convolutions beside a 1x1 shortcut: (B, C, H, W) to (B, C', H/s, W/s)."""

    def __init__(self, dim_in: int, dim_out: int, groups: int, stride: int = 1) -> None:
        super().__init__()
        self.first = nn.Conv2d(dim_in, dim_out, 3, stride, 1, bias=False)
        self.first_norm = nn.GroupNorm(groups, dim_out)
        self.second = nn.Conv2d(dim_out, dim_out, 3, 1, 1, bias=False)
        self.second_norm = nn.GroupNorm(groups, dim_out)
        same = dim_in == dim_out and stride == 1
        self.shortcut = nn.Identity() if same else nn.Conv2d(dim_in, dim_out, 1, stride)

    def forward(self, image: Tensor) -> Tensor:
        """Convolve."""
        main = torch.relu(self.first_norm(self.first(image)))
        return torch.relu(self.second_norm(self.second(main)) + self.shortcut(image))


class ImageEncoder(nn.Module):
    """Encoder to 1/32 of the image, decoder back to the output stride, then 1x1 to ``dim`` channels."""

    def __init__(self, config: ImageConfig) -> None:
        super().__init__()
        self.dropout = config.dropout
        widths, groups = config.widths, config.groups
        self.stem = nn.Conv2d(3, config.stem_dim, 7, 2, 3)
        dims_in = (config.stem_dim, *widths[:-1])
        self.down = nn.ModuleList(
            ResidualConv(dim_in, dim_out, groups, stride=1 if level == 0 else 2)
            for level, (dim_in, dim_out) in enumerate(zip(dims_in, widths, strict=True))
        )
        self.up = nn.ModuleList()
        dim = widths[-1]
        for level in range(len(widths) - 2, _last_level(config) - 1, -1):
            self.up.append(ResidualConv(dim + widths[level], config.dim, groups))
            dim = config.dim
        self.full = ResidualConv(dim + 3, dim, groups) if config.output_stride == 1 else None
        self.out = nn.Conv2d(dim, config.dim, 1)
        self.null = nn.Parameter(torch.randn(1, config.dim) * 0.02)

    def forward(self, image: Tensor | None) -> ImageFeatures:
        """(3, H, W) normalised, or None, to a (d, H/stride, W/stride) grid; training drops some images."""
        dropped = self.training and float(torch.rand(())) < self.dropout
        if image is None or dropped:
            return ImageFeatures(None, self.null)
        features = torch.relu(self.stem(image[None]))
        skips = []
        for block in self.down:
            features = block(features)
            skips.append(features)
        for block, skip in zip(self.up, reversed(skips[:-1]), strict=False):
            features = _joined(block, features, skip)
        if self.full is not None:
            features = _joined(self.full, features, image[None])
        return ImageFeatures(self.out(features)[0], self.null)


def _joined(block: nn.Module, features: Tensor, skip: Tensor) -> Tensor:
    larger = F.interpolate(features, size=skip.shape[-2:], mode="bilinear", align_corners=False)
    joined: Tensor = block(torch.cat([larger, skip], dim=1))
    return joined


def _last_level(config: ImageConfig) -> int:
    # Level l of the encoder has stride 2 ** (l + 1); stride 1 adds one block on the image itself.
    level = max(config.output_stride.bit_length() - 2, 0)
    if level > len(config.widths) - 2:
        raise ValueError(f"output_stride {config.output_stride} is not finer than the encoder's last stage")
    return level


def pool_tokens(grid: Tensor, pool: int) -> tuple[Tensor, int, int]:
    """Average-pool (d, h, w) and flatten to tokens (h' * w', d), row by row, with h' and w'."""
    pooled = F.avg_pool2d(grid[None], pool, ceil_mode=True)[0]
    _, height, width = pooled.shape
    return pooled.flatten(1).t(), height, width
