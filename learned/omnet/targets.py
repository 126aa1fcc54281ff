# SPDX-License-Identifier: MIT
"""Training targets: the true poses of a batch, and which points overlap under them."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.omnet.quaternions import pose_of

_CHUNK_VALUES = 2**22


@dataclass(frozen=True, kw_only=True)
class OmnetTargets:
    """True poses from source to target, in the units of the batch."""

    transform: Tensor  # (B, 3, 4)
    pose: Tensor  # (B, 7) with w not negative

    def to(self, device: torch.device | str) -> OmnetTargets:
        """The same targets on another device."""
        return OmnetTargets(transform=self.transform.to(device), pose=self.pose.to(device))


def compute_targets(transforms: Tensor) -> OmnetTargets:
    """Targets from poses (B, 3, 4), (B, 4, 4) or one (4, 4) in the batch's units, see `Units.normalised`."""
    transforms = transforms.reshape(-1, *transforms.shape[-2:])[:, :3].float()
    return OmnetTargets(transform=transforms, pose=pose_of(transforms.double()).float())


def overlap_labels(
    source: Tensor, target: Tensor, masks: tuple[Tensor, Tensor] | None, transform: Tensor, distance: float
) -> tuple[Tensor, Tensor]:
    """Which points have a correspondence nearer than a distance under the true pose.

    Parameters
    ----------
    source, target
        (B, N, 3), (B, M, 3) the input clouds, not moved by the network.
    masks
        (B, N), (B, M) bool: points left out neither have nor are correspondences; None for all points.
    transform
        (B, 3, 4) true pose.

    Returns
    -------
    Tensor, Tensor
        (B, N), (B, M) bool.
    """
    moved = source @ transform[:, :, :3].transpose(1, 2) + transform[:, None, :, 3]
    of_source, of_target = [], []
    for k in range(len(source)):
        near = _near(moved[k], target[k], distance, None if masks is None else (masks[0][k], masks[1][k]))
        of_source.append(near[0])
        of_target.append(near[1])
    return torch.stack(of_source), torch.stack(of_target)


def _near(
    source: Tensor, target: Tensor, distance: float, masks: tuple[Tensor, Tensor] | None
) -> tuple[Tensor, Tensor]:
    rows, columns = [], target.new_zeros(len(target), dtype=torch.bool)
    start = 0
    for part in source.split(max(1, _CHUNK_VALUES // max(len(target), 1))):
        close = (part[:, None] - target[None]).square().sum(2) < distance**2
        if masks is not None:
            close = close & masks[0][start : start + len(part), None] & masks[1][None]
        rows.append(close.any(1))
        columns = columns | close.any(0)
        start += len(part)
    return torch.cat(rows), columns
