# SPDX-License-Identifier: MIT
"""Voxel-grid subsampling of tensors: the centroid of the points of each cell."""

from __future__ import annotations

import torch
from torch import Tensor


def grid_subsample(points: Tensor, voxel: float) -> Tensor:
    """Centroids of the occupied cells, ordered by cell (docs/methods.md 2.2).

    Parameters
    ----------
    points
        (N, 3) float32, metres.
    voxel
        Edge of a cell in metres.

    Returns
    -------
    Tensor
        (M, 3) float32, M <= N.

    Raises
    ------
    ValueError
        No points, or a voxel that is not positive, or so small that cells cannot be numbered.
    """
    if points.shape[0] == 0 or voxel <= 0:
        raise ValueError(
            f"grid_subsample needs points and a positive voxel, got {points.shape[0]} and {voxel}"
        )
    cells = _cells(points, voxel)
    _, cell_of_point, counts = torch.unique(cells, return_inverse=True, return_counts=True)
    sums = torch.zeros(counts.shape[0], 3, dtype=torch.float64, device=points.device)
    # float64 sums make the centroid independent of the points' order up to float32 rounding
    sums.index_add_(0, cell_of_point, points.double())
    return (sums / counts[:, None]).to(points.dtype)


def _cells(points: Tensor, voxel: float) -> Tensor:
    # The origin and the division stay in the points' own precision, as in the reference implementation:
    # a float64 division would put some border points of a float32 cloud into the next cell.
    size = torch.tensor(voxel, dtype=points.dtype, device=points.device)
    origin = torch.floor(points.amin(0) / size) * size
    index = torch.floor((points - origin) / size).long()
    extent = index.amax(0) + 1
    if float(extent.double().prod()) > 2**62:
        raise ValueError(
            f"{extent.tolist()} cells of {voxel} m cannot be numbered: the voxel is too small for the cloud"
        )
    return index[:, 0] + extent[0] * (index[:, 1] + extent[1] * index[:, 2])
