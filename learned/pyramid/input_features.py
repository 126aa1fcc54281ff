# SPDX-License-Identifier: MIT
"""Input features of the first stage's points: a constant, or four numbers on their neighbourhood."""

from __future__ import annotations

from typing import Literal

import torch
from torch import Tensor

from hybridreg.learned.pyramid.point_pyramid import Pyramid

_COLUMN = 4.0  # metres: edge of the columns whose lowest point is taken for the ground


def input_features(pyramid: Pyramid, kind: Literal["ones", "geometric"]) -> Tensor:
    """(N_1, 1) ones, or (N_1, 4): one, height above ground in 10 m, ``|n_z|``, planarity (docs/methods.md 2.6)."""
    points = pyramid.points[0]
    ones = points.new_ones(len(points), 1)
    if kind == "ones":
        return ones
    height = torch.cat([_height(cloud) for cloud in pyramid.clouds(0)]) / 10.0
    upright, planarity = _local_shape(points, pyramid.neighbors[0])
    return torch.cat([ones, height[:, None], upright[:, None], planarity[:, None]], dim=1)


def _height(points: Tensor) -> Tensor:
    cells = torch.floor(points[:, :2] / _COLUMN).long()
    _, column = torch.unique(cells, dim=0, return_inverse=True)
    lowest = points.new_full((int(column.max()) + 1,), torch.inf)
    lowest.scatter_reduce_(0, column, points[:, 2], "amin")
    return points[:, 2] - lowest[column]


def _local_shape(points: Tensor, neighbors: Tensor) -> tuple[Tensor, Tensor]:
    valid = (neighbors < len(points)).to(points.dtype)[..., None]  # (N, k, 1)
    local = points[neighbors.clamp_max(len(points) - 1)] - points[:, None]
    count = valid.sum(1).clamp_min(1.0)
    local = (local - ((local * valid).sum(1) / count)[:, None]) * valid
    covariance = local.transpose(1, 2) @ local / count[..., None]
    values, vectors = torch.linalg.eigh(covariance)  # ascending
    planarity = (values[:, 1] - values[:, 0]) / values[:, 2].clamp_min(1e-9)
    return vectors[:, 2, 0].abs(), planarity
