# SPDX-License-Identifier: MIT
"""Spherical voxels: the number of points of a patch in each cell of radius, azimuth and polar angle.

Nothing is divided by the number of points or by a cell's volume, and repeated points count repeatedly. The original
fills a tensor of (points, cells) a patch, 98 MB at 2,048 points; here eight weights a point are accumulated in place.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor

Grid = tuple[int, int, int]


def spherical(points: Tensor) -> Tensor:
    """(..., 3) metres to radius (metres), azimuth in [0, 2 pi] (0 at -x), polar angle from +z in [0, pi]."""
    radius = points.square().sum(-1).sqrt()
    azimuth = torch.atan2(points[..., 1], points[..., 0]) + math.pi
    flat = points[..., :2].square().sum(-1).sqrt()
    return torch.stack([radius, azimuth, torch.atan2(flat, points[..., 2])], dim=-1)


def voxels(coordinates: Tensor, radius: float, grid: Grid) -> Tensor:
    """Points with spherical coordinates (n, k, 3) distributed over cells (n, radial, azimuth, elevation).

    Each point has weight 1 in all, linear in the three coordinates between the centres of cells. At the innermost half
    shell and at both poles the end cell takes all of it; azimuth wraps around; of the outermost half shell the part
    beyond the end is lost; nothing beyond ``radius`` metres counts (module/SphericalVoxelization.py).
    """
    radial, azimuth, elevation = grid
    r, a, e = coordinates.unbind(-1)
    low_r, part_r = _between(r, radius / radial)
    low_a, part_a = _between(a, 2.0 * math.pi / azimuth)
    low_e, part_e = _between(e, math.pi / elevation)
    inside = (r <= radius).to(r.dtype)
    sides_r = (
        (low_r, torch.where(low_r < 0, 0.0, 1.0 - part_r)),
        (low_r + 1, torch.where(low_r < 0, 1.0, part_r)),
    )
    sides_a = ((low_a % azimuth, 1.0 - part_a), ((low_a + 1) % azimuth, part_a))
    sides_e = ((low_e.clamp_min(0), 1.0 - part_e), ((low_e + 1).clamp_max(elevation - 1), part_e))
    out = coordinates.new_zeros(len(coordinates), radial * azimuth * elevation)
    for index_r, weight_r in sides_r:
        # A cell beyond either end has no weight: the inner one above, the outer one here.
        weight_r = torch.where((index_r >= 0) & (index_r < radial), weight_r, 0.0) * inside
        for index_a, weight_a in sides_a:
            for index_e, weight_e in sides_e:
                cell = (index_r.clamp(0, radial - 1) * azimuth + index_a) * elevation + index_e
                out.scatter_add_(1, cell, weight_r * weight_a * weight_e)
    return out.view(-1, radial, azimuth, elevation)


def counts(coordinates: Tensor, radius: float, grid: Grid) -> Tensor:
    """The variant without interpolation: numbers (n, radial, azimuth, elevation) of points in each cell."""
    steps = coordinates.new_tensor([radius / grid[0], 2.0 * math.pi / grid[1], math.pi / grid[2]])
    cell = (coordinates / steps).floor().long()
    inside = ((cell >= 0) & (cell < torch.tensor(grid, device=cell.device))).all(-1)
    row = (cell[..., 0] * grid[1] + cell[..., 1]) * grid[2] + cell[..., 2]
    out = coordinates.new_zeros(len(coordinates), math.prod(grid))
    out.scatter_add_(1, torch.where(inside, row, 0), inside.to(out.dtype))
    return out.view(-1, *grid)


def _between(value: Tensor, step: float) -> tuple[Tensor, Tensor]:
    """The cell whose centre lies below a value, and how far the value is from it towards the next, in cells."""
    place = value / step - 0.5
    low = place.floor()
    return low.long(), place - low
