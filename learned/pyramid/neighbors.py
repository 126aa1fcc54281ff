# SPDX-License-Identifier: MIT
"""Neighbours within a radius, nearest first: scipy's tree on the CPU, tensors on a GPU."""

from __future__ import annotations

import numpy as np
import torch
from scipy.spatial import cKDTree
from torch import Tensor

_CHUNK_PAIRS = 2**25


def radius_neighbors(
    queries: Tensor, supports: Tensor, radius: float, limit: int, *, workers: int = 1
) -> Tensor:
    """Indices of at most ``limit`` supports nearer than ``radius``, nearest first.

    Parameters
    ----------
    queries, supports
        (N, 3) and (M, 3) float32 in metres, on one device.
    radius
        Metres.
    limit
        Columns of the result; farther neighbours are dropped.
    workers
        Threads of the tree search on the CPU.

    Returns
    -------
    Tensor
        (N, limit) int64; missing neighbours are M, the padding index.
    """
    if queries.is_cuda:
        return _radius_neighbors_tensor(queries, supports, radius, limit)
    tree = cKDTree(supports.numpy().astype(np.float64))
    _, index = tree.query(queries.numpy(), k=limit, distance_upper_bound=radius, workers=workers)
    return torch.from_numpy(np.asarray(index, dtype=np.int64).reshape(len(queries), limit))


def _radius_neighbors_tensor(queries: Tensor, supports: Tensor, radius: float, limit: int) -> Tensor:
    n_supports = supports.shape[0]
    k = min(limit, n_supports)
    found = []
    for block in queries.split(max(1, _CHUNK_PAIRS // n_supports)):
        # The exact differences, not the expanded square, which at 100 m would be off by centimetres.
        distance = torch.cdist(block, supports, compute_mode="donot_use_mm_for_euclid_dist")
        nearest, index = distance.topk(k, largest=False)
        found.append(torch.where(nearest < radius, index, n_supports))
    return torch.nn.functional.pad(torch.cat(found), (0, limit - k), value=n_supports)


def nearest_neighbor(queries: Tensor, supports: Tensor) -> Tensor:
    """Index (N,) int64 of the nearest support of each query, at any distance."""
    if not queries.is_cuda:
        _, index = cKDTree(supports.numpy().astype(np.float64)).query(queries.numpy())
        return torch.from_numpy(np.asarray(index, dtype=np.int64))
    blocks = queries.split(max(1, _CHUNK_PAIRS // supports.shape[0]))
    return torch.cat(
        [torch.cdist(b, supports, compute_mode="donot_use_mm_for_euclid_dist").argmin(1) for b in blocks]
    )


def count_neighbors(queries: Tensor, supports: Tensor, radius: float) -> Tensor:
    """Number (N,) int64 of supports nearer than ``radius``; for the calibration of neighbour limits."""
    tree = cKDTree(supports.cpu().numpy().astype(np.float64))
    counts = tree.query_ball_point(queries.cpu().numpy(), r=radius, return_length=True)
    return torch.from_numpy(np.asarray(counts, dtype=np.int64))


def pairs_within(first: Tensor, second: Tensor, radius: float) -> tuple[Tensor, Tensor]:
    """Rows (P,), (P,) int64 of all points (N, 3), (M, 3) of one frame that are nearer to each other than ``radius``.

    Ordered by the first cloud's points. Searched on the CPU, in float64.
    """
    trees = [cKDTree(cloud.detach().cpu().numpy().astype(np.float64)) for cloud in (first, second)]
    near = trees[0].sparse_distance_matrix(trees[1], radius, output_type="coo_matrix")
    keep = near.data < radius
    order = np.lexsort((near.col[keep], near.row[keep]))
    rows, columns = (torch.from_numpy(side[keep][order].astype(np.int64)) for side in (near.row, near.col))
    return rows.to(first.device), columns.to(first.device)
