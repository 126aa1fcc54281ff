# SPDX-License-Identifier: MIT
"""Positional encodings: sinusoids of a number, of an image grid, and learned ones of points (docs/methods.md 6.2)."""

from __future__ import annotations

import math
from typing import Literal

import torch
from torch import Tensor, nn

_METRES = 40.0  # metres: unit of the coordinates, about the usual range


def frequencies(dim: int) -> Tensor:
    """``10000^(-2m/dim)`` for m < dim / 2, (dim / 2,) float32."""
    return torch.exp(torch.arange(0, dim, 2).float() * (-math.log(10000.0) / dim))


def sinusoids(values: Tensor, frequency: Tensor) -> Tensor:
    """Sine and cosine interleaved: (...) to (..., 2 * len(frequency))."""
    omega = values[..., None] * frequency
    return torch.stack([torch.sin(omega), torch.cos(omega)], dim=-1).flatten(-2)


def image_grid_encoding(height: int, width: int, dim: int, device: torch.device) -> Tensor:
    """(height * width, dim): half the channels for the column, half for the row, both scaled to [0, 2 pi]."""
    rows = torch.linspace(0.0, 2 * math.pi, height, device=device)
    columns = torch.linspace(0.0, 2 * math.pi, width, device=device)
    frequency = frequencies(dim // 2).to(device)
    by_column = sinusoids(columns, frequency)[None].expand(height, -1, -1)
    by_row = sinusoids(rows, frequency)[:, None].expand(-1, width, -1)
    return torch.cat([by_column, by_row], dim=-1).reshape(height * width, -1)


class PointPosition(nn.Module):
    """Encode superpoint positions (n, 3) in metres as (n, dim).

    ``mlp`` uses coordinates about the points' centroid; ``radial`` only range and height in the sensor's frame, which
    are invariant to yaw; ``none`` gives zeros.
    """

    def __init__(self, dim: int, kind: Literal["none", "mlp", "radial"]) -> None:
        super().__init__()
        self.dim, self.kind = dim, kind
        inputs = {"none": 0, "mlp": 3, "radial": 2}[kind]
        self.net = _mlp(inputs, dim) if inputs else None

    def forward(self, points: Tensor) -> Tensor:
        """(n, 3) to (n, dim)."""
        if self.net is None:
            return points.new_zeros(len(points), self.dim)
        if self.kind == "mlp":
            return self.net((points - points.mean(0)) / _METRES)
        radial = torch.stack([points[:, :2].norm(dim=1), points[:, 2]], dim=1)
        return self.net(radial / _METRES)


def _mlp(inputs: int, dim: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(inputs, 32), nn.ReLU(), nn.Linear(32, 64), nn.ReLU(), nn.Linear(64, dim), nn.LayerNorm(dim)
    )
