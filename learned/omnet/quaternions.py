# SPDX-License-Identifier: MIT
"""Unit quaternions (w, x, y, z) and poses (w, x, y, z, t) as OMNet uses them (common/quaternion.py, common/se3.py)."""

from __future__ import annotations

import torch
from torch import Tensor


def multiply(first: Tensor, second: Tensor) -> Tensor:
    """(..., 4) the rotation ``first``, then the rotation ``second``: Hamilton's product ``second * first``. Not
    normalised."""
    b, a = first.unbind(-1), second.unbind(-1)
    return torch.stack(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
            a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
        ],
        -1,
    )


def rotate(quaternion: Tensor, points: Tensor) -> Tensor:
    """Points (..., n, 3) rotated by quaternions (..., 4)."""
    w, v = quaternion[..., None, :1], quaternion[..., None, 1:].expand_as(points)
    across = torch.linalg.cross(v, points)
    return points + 2.0 * (w * across + torch.linalg.cross(v, across))


def compose(first: Tensor, second: Tensor) -> Tensor:
    """(..., 7) the pose ``first``, then the pose ``second``."""
    turned = rotate(second[..., :4], first[..., None, 4:])[..., 0, :]
    return torch.cat([multiply(first[..., :4], second[..., :4]), turned + second[..., 4:]], -1)


def matrix_of(pose: Tensor) -> Tensor:
    """(..., 3, 4) of poses (..., 7)."""
    w, x, y, z = pose[..., :4].unbind(-1)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    turn = torch.stack([torch.stack(row, -1) for row in rows], -2)
    return torch.cat([turn, pose[..., 4:, None]], -1)


def pose_of(matrix: Tensor) -> Tensor:
    """(..., 7) of matrices (..., 3 or 4, 4), with w not negative.

    From the largest of the four components, which loses no digits for any rotation.
    """
    R = matrix[..., :3, :3]
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    squares = torch.stack([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz], -1)
    wx, wy, wz = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    xy, xz, yz = R[..., 0, 1] + R[..., 1, 0], R[..., 0, 2] + R[..., 2, 0], R[..., 1, 2] + R[..., 2, 1]
    # Row k holds 4 q_k q: any of them is the quaternion up to its length.
    rows = [
        [squares[..., 0], wx, wy, wz],
        [wx, squares[..., 1], xy, xz],
        [wy, xy, squares[..., 2], yz],
        [wz, xz, yz, squares[..., 3]],
    ]
    table = torch.stack([torch.stack(row, -1) for row in rows], -2)
    largest = squares.argmax(-1)[..., None, None].expand(*squares.shape[:-1], 1, 4)
    quaternion = table.gather(-2, largest)[..., 0, :]
    quaternion = quaternion / quaternion.norm(dim=-1, keepdim=True)
    quaternion = torch.where(quaternion[..., :1] < 0, -quaternion, quaternion)
    return torch.cat([quaternion, matrix[..., :3, 3]], -1)
