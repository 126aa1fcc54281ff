# SPDX-License-Identifier: MIT
"""Patches of equal size: each point belongs to its nearest superpoint, and a mask marks empty slots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from torch import Tensor
from torch.nn import functional as F

from hybridreg.learned.pyramid.patches import build_patches


@dataclass(frozen=True)
class PatchIndex:
    """Points of each patch."""

    index: Tensor  # (B, P) int64 into the cloud's points, pad their number
    mask: Tensor  # (B, P) bool: is the slot filled?

    @property
    def filled(self) -> Tensor:
        """The same with point 0 in the empty slots."""
        return self.index.masked_fill(~self.mask, 0)

    @property
    def visible(self) -> Tensor:
        """(B, P) bool: slots for the attention; an empty patch shows its first slot, so that there is one."""
        shown = self.mask.clone()
        shown[:, 0] |= ~self.mask.any(1)
        return shown

    def take(self, patches: Tensor) -> PatchIndex:
        """Some of the patches."""
        return PatchIndex(self.index[patches], self.mask[patches])


def patch_index(points: Tensor, nodes: Tensor, size: int, rule: Literal["nearest", "first"]) -> PatchIndex:
    """Patches of ``size`` slots of the points (N, 3) of each superpoint (n, 3); ``rule`` as `build_patches`."""
    patches = build_patches(points, nodes, size, rule)
    missing = size - patches.index.shape[1]
    return PatchIndex(
        F.pad(patches.index, (0, missing), value=len(points)), F.pad(patches.mask, (0, missing))
    )
