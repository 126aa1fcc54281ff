# SPDX-License-Identifier: MIT
"""OMNet's losses of every iteration: overlap masks in both published forms, and poses (loss/loss.py; docs/methods.md
11.4)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import torch
from torch import Tensor
from torch.nn import functional as F

from hybridreg.learned.losses.loss_parts import LossParts
from hybridreg.learned.omnet.config import OmnetLossConfig
from hybridreg.learned.omnet.targets import OmnetTargets, overlap_labels

if TYPE_CHECKING:
    from hybridreg.learned.omnet.network import OmnetOutput, Step


class OmnetLosses(LossParts):
    """By name and iteration; the log has each name's sum over the iterations."""

    @property
    def parts(self) -> dict[str, Tensor]:
        """Sums over the iterations."""
        return {
            name: torch.stack([loss for key, loss in self.items() if key.startswith(f"{name}_")]).sum()
            for name in ("mask", "quaternion", "translation")
        }


def omnet_losses(output: OmnetOutput, targets: OmnetTargets, config: OmnetLossConfig) -> OmnetLosses:
    """Weighted losses by name: ``mask_i``, ``quaternion_i`` and ``translation_i`` of every iteration i."""
    found = OmnetLosses()
    for i, step in enumerate(output.steps):
        labels = step_labels(output, step, targets, config)
        logits = (step.source_logits, step.target_logits)
        sides = [mask_loss(*side, config) for side in zip(logits, labels, strict=True)]
        found[f"mask_{i}"] = (sides[0] + sides[1]) / 2
        quaternion = quaternion_loss(step.pose[:, :4], targets.pose[:, :4], signed=config.signed)
        found[f"quaternion_{i}"] = config.quaternion_weight * quaternion
        squared = F.mse_loss(step.pose[:, 4:], targets.pose[:, 4:])
        found[f"translation_{i}"] = config.translation_weight * squared
    return found


def step_labels(
    output: OmnetOutput, step: Step, targets: OmnetTargets, config: OmnetLossConfig
) -> tuple[Tensor, Tensor]:
    """(B, N), (B, M) bool: the points that overlap, among those that the iteration saw (see
    `OmnetLossConfig.labels`)."""
    masks = (step.source_mask, step.target_mask) if config.labels == "masked" else None
    return overlap_labels(output.source, output.target, masks, targets.transform, config.overlap_distance)


def mask_loss(logits: Tensor, labels: Tensor, config: OmnetLossConfig) -> Tensor:
    """Weighted cross-entropy of scores (B, 2, N) against labels (B, N) bool, see `OmnetLossConfig.mask_form`."""
    weights = torch.tensor(config.class_weights, dtype=logits.dtype, device=logits.device)
    if config.mask_form == "torch":
        return F.cross_entropy(logits, labels.long(), weight=weights)
    of_points = F.cross_entropy(logits, labels.long(), weight=weights, reduction="none").sum(1)
    return (of_points / weights[labels.long()].sum(1)).mean()


def quaternion_loss(quaternion: Tensor, true: Tensor, *, signed: bool) -> Tensor:
    """Mean absolute difference of quaternions (B, 4), see `OmnetLossConfig.signed`."""
    apart = (quaternion - true).abs().mean(1)
    if not signed:
        apart = torch.minimum(apart, (quaternion + true).abs().mean(1))
    return apart.mean()
