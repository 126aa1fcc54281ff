# SPDX-License-Identifier: MIT
"""A patch's reference axis, its orientation, and the rotation that aligns it with z."""

from __future__ import annotations

from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional as F

from hybridreg.scene import Level

# Metres above the middle of a cloud of unknown viewpoint: axes that face this point look upwards.
_ABOVE = 100.0


def place(level: Level, facing: Literal["origin", "sensor"]) -> NDArray[np.float64]:
    """Where (3,) the axes of a cloud's patches face, metres in its frame (`SphereNetConfig.facing`)."""
    if facing == "origin":
        return np.zeros(3)
    return level.centre if level.viewpoint is not None else level.centre + [0.0, 0.0, _ABOVE]


def reference_axes(patches: Tensor, keypoints: Tensor) -> Tensor:
    """Directions (n, 3) of least spread about the keypoints, of unit length, facing the cloud's origin.

    Parameters
    ----------
    patches
        (n, k, 3) points less their keypoint: the spread is about the keypoint, not about the mean, and unweighted.
    keypoints
        (n, 3) in the cloud's own frame: where its origin lies decides the axis's sign (script/common.py).
    """
    axes = torch.linalg.eigh(patches.transpose(1, 2) @ patches)[1][:, :, 0]
    away = (axes * keypoints).sum(1, keepdim=True) > 0
    return F.normalize(torch.where(away, -axes, axes), dim=1)


def upright_rotations(axes: Tensor, frames: Literal["released", "right"], batch: int) -> Tensor:
    """Rotations (n, 3, 3) with ``local = points @ R``: the smallest rotation of each axis (n, 3) onto +z.

    "released" makes them in batches of ``batch`` rows, and where a batch has exactly three rows, its cross products
    mix the patches: the original names no dimension, and torch takes the first of size three. Published descriptors
    have that error in the last three keypoints of a cloud wherever their number leaves a remainder of three. An axis
    at exactly -z gets the identity there; "right" gives it a half turn.
    """
    if frames == "right":
        return _rotations(axes, -1, half_turns=True)
    blocks = axes.split(batch)
    return torch.cat([_rotations(b, 0 if len(b) == 3 else -1, half_turns=False) for b in blocks])


def _rotations(axes: Tensor, dim: int, *, half_turns: bool) -> Tensor:
    # Rodrigues' formula. In this order of operations, because the arc cosine near 1 has lost half of float32's digits
    # and the published descriptors with it.
    up = axes.new_tensor([0.0, 0.0, 1.0]).expand_as(axes)
    angle = torch.acos(F.cosine_similarity(axes, up).clamp(-1.0, 1.0))[:, None, None]
    about = F.normalize(torch.linalg.cross(axes, up, dim=dim), dim=1)
    x, y, z = about.unbind(1)
    none = torch.zeros_like(x)
    K = torch.stack([none, -z, y, z, none, -x, -y, x, none], 1).view(-1, 3, 3)
    R = torch.eye(3).to(axes) + torch.sin(angle) * K + (1.0 - torch.cos(angle)) * (K @ K)
    if half_turns:
        down = (axes[:, 2] <= -1.0) | (about.norm(dim=1) < 0.5) & (axes[:, 2] < 0.0)
        R = torch.where(down[:, None, None], torch.diag(axes.new_tensor([1.0, -1.0, -1.0])), R)
    return R.transpose(1, 2)
