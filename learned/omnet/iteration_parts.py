# SPDX-License-Identifier: MIT
"""The four parts of an iteration: encoder, fusion, decoder, regression (model/module.py)."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hybridreg.learned.omnet.config import OmnetConfig


class _Layer(nn.Module):
    # The linear map keeps its bias although a normalisation follows, as published.
    def __init__(self, linear: nn.Module, width: int, config: OmnetConfig) -> None:
        super().__init__()
        self.linear = linear
        self.norm = nn.BatchNorm1d(width, eps=config.bn_eps, momentum=config.bn_momentum)

    def forward(self, x: Tensor) -> Tensor:
        out: Tensor = self.norm(self.linear(x)).relu()
        return out


def _point_layers(dim_in: int, widths: Sequence[int], config: OmnetConfig) -> nn.ModuleList:
    ins = (dim_in, *widths[:-1])
    return nn.ModuleList(_Layer(nn.Conv1d(i, o, 1), o, config) for i, o in zip(ins, widths, strict=True))


class Encoder(nn.Module):
    """Points (B, 3, N) and their mask (B, 1, N) to features (B, l, N), the last layer's, and pooled ones (B, g)."""

    def __init__(self, config: OmnetConfig) -> None:
        super().__init__()
        self.local_layer = config.local_layer
        self.layers = _point_layers(3, config.encoder, config)

    def forward(self, points: Tensor, mask: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Both features of points are zero where the mask is; the layers after the local one see it unmasked."""
        x = local = points
        for i, layer in enumerate(self.layers):
            x = layer(x)
            if i + 1 == self.local_layer:
                local = x
        last = x * mask
        # Zeros take part in the maximum; after a ReLU that equals leaving the points out.
        return local * mask, last, last.amax(2)


class Fusion(nn.Module):
    """A point's own features, its cloud's and the other cloud's to fused ones (B, f, N), zero where the mask is."""

    def __init__(self, config: OmnetConfig) -> None:
        super().__init__()
        self.layers = _point_layers(config.local_dim + 2 * config.encoder[-1], config.fusion, config)

    def forward(self, local: Tensor, own: Tensor, other: Tensor, mask: Tensor) -> Tensor:
        """local (B, l, N), own and other (B, g), mask (B, 1, N)."""
        clouds = torch.cat([own, other], 1)[:, :, None].expand(-1, -1, local.shape[2])
        x = torch.cat([local, clouds], 1)
        for layer in self.layers:
            x = layer(x)
        return x * mask


class Decoder(nn.Module):
    """Fused features to class scores (B, 2, N), and the hidden layers' features side by side (B, d, N), masked."""

    def __init__(self, config: OmnetConfig) -> None:
        super().__init__()
        self.layers = _point_layers(config.fusion[-1], config.decoder, config)
        self.classes = nn.Conv1d(config.decoder[-1], 2, 1)

    def forward(self, fused: Tensor, mask: Tensor) -> tuple[Tensor, Tensor]:
        """Fused (B, f, N), mask (B, 1, N)."""
        x, hidden = fused, []
        for layer in self.layers:
            x = layer(x)
            hidden.append(x)
        return self.classes(x), torch.cat(hidden, 1) * mask


class Regression(nn.Module):
    """Pooled vector (B, p) to a pose (B, 7): unit quaternion, w first, and translation."""

    def __init__(self, config: OmnetConfig) -> None:
        super().__init__()
        ins = (config.regression_input, *config.regression[:-1])
        self.layers = nn.ModuleList(
            _Layer(nn.Linear(i, o), o, config) for i, o in zip(ins, config.regression, strict=True)
        )
        self.pose = nn.Linear(config.regression[-1], 7)
        self.eps = config.normalize_eps

    def forward(self, pooled: Tensor) -> Tensor:
        """See the class."""
        for layer in self.layers:
            pooled = layer(pooled)
        pose = self.pose(pooled)
        return torch.cat([F.normalize(pose[:, :4], dim=1, eps=self.eps), pose[:, 4:]], 1)
