# SPDX-License-Identifier: MIT
"""Point-pair features: rotation-invariant descriptions of two points with normals."""

from __future__ import annotations

import math

import torch
from torch import Tensor


def pair_features(points: Tensor, normals: Tensor, neighbors: Tensor, neighbor_normals: Tensor) -> Tensor:
    """Distance and three angles of each point with its neighbours (RoITr, equation 2; lib/utils.py, calc_ppf_gpu).

    Parameters
    ----------
    points, normals
        (n, 3) metres, (n, 3) unit length.
    neighbors, neighbor_normals
        (n, k, 3), (n, k, 3).

    Returns
    -------
    Tensor
        (n, k, 4): |d| in metres, neither scaled nor embedded; the angles between the point's normal and d, the
        neighbour's normal and d, and the two normals, divided by pi. d leads from the point to the neighbour.
    """
    apart = neighbors - points[:, None]
    own = normals[:, None].expand_as(apart)
    angles = (_angle(own, apart), _angle(neighbor_normals, apart), _angle(own, neighbor_normals))
    return torch.stack([apart.square().sum(-1).sqrt(), *angles], dim=-1)


def _angle(first: Tensor, second: Tensor) -> Tensor:
    sine = torch.linalg.cross(first, second, dim=-1).square().sum(-1).sqrt()
    return torch.atan2(sine, (first * second).sum(-1)) / math.pi
