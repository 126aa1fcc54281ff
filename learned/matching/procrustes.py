# SPDX-License-Identifier: MIT
"""Weighted Procrustes (Kabsch): the least-squares rigid motion from source to target (docs/methods.md 9.1)."""

from __future__ import annotations

import torch
from torch import Tensor

_EPS = 1e-5


def weighted_procrustes(source: Tensor, target: Tensor, weight: Tensor) -> Tensor:
    """``T_target_source`` (..., 4, 4) that minimises the weighted squared distances.

    Parameters
    ----------
    source, target
        (..., n, 3) metres.
    weight
        (..., n), not negative. All zero gives the identity; so do weights that are not finite.

    Notes
    -----
    Computed on the CPU, where 3x3 decompositions are faster, in the float type of the points. The weights are
    divided by their sum plus 1e-5, as the published networks do.
    """
    device = source.device
    source, target, weight = (t.detach().cpu().to(source.dtype) for t in (source, target, weight))
    identity = torch.eye(4, dtype=source.dtype)
    total = weight.sum(-1, keepdim=True)
    weight = (weight / (total + _EPS))[..., None]  # (..., n, 1)
    centre_source, centre_target = (
        (source * weight).sum(-2, keepdim=True),
        (target * weight).sum(-2, keepdim=True),
    )
    covariance = (source - centre_source).transpose(-1, -2) @ (weight * (target - centre_target))
    usable = torch.isfinite(covariance).flatten(-2).all(-1) & (total[..., 0] > 1e-8)
    covariance = torch.where(usable[..., None, None], covariance, identity[:3, :3])
    rotation = _nearest_rotation(covariance)
    shift = centre_target.transpose(-1, -2) - rotation @ centre_source.transpose(-1, -2)
    transform = identity.repeat(*covariance.shape[:-2], 1, 1)
    transform[..., :3, :3], transform[..., :3, 3:] = rotation, shift
    return torch.where(usable[..., None, None], transform, identity).to(device)


def _nearest_rotation(covariance: Tensor) -> Tensor:
    left, _, right = torch.linalg.svd(covariance)  # H = U S Vh
    right = right.transpose(-1, -2)
    # The smallest axis is flipped where the best orthogonal matrix is a reflection.
    flip = torch.ones(covariance.shape[:-1], dtype=covariance.dtype)
    determinant = torch.linalg.det(right @ left.transpose(-1, -2))
    flip[..., 2] = torch.where(determinant < 0, -1.0, 1.0)
    return right @ torch.diag_embed(flip) @ left.transpose(-1, -2)


def apply_transform(points: Tensor, transform: Tensor) -> Tensor:
    """(..., n, 3) moved by (..., 4, 4): ``P @ R.T + t``."""
    return points @ transform[..., :3, :3].transpose(-1, -2) + transform[..., None, :3, 3]
