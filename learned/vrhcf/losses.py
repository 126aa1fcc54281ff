# SPDX-License-Identifier: MIT
"""SphereNet's loss: a hinge on the true match and on the nearest other one of the batch (docs/methods.md 11.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import torch
from torch import Tensor
from torch.nn import functional as F

from hybridreg.learned.vrhcf.config import SphereNetConfig
from hybridreg.learned.vrhcf.targets import SphereTargets

if TYPE_CHECKING:
    from hybridreg.learned.vrhcf.network import SphereOutput

_EPS = 1e-12  # under the root, so that its gradient stays finite
_ITSELF = 1e5  # added to the true match's distance, so that it is not the nearest other


@dataclass(frozen=True)
class SphereLosses:
    """The loss, and the share of anchors whose true match is nearer than every other."""

    total: Tensor
    accuracy: Tensor  # in [0, 1]

    @property
    def parts(self) -> dict[str, Tensor]:
        """Before weighting, for the log."""
        return {"hardest": self.total}

    @property
    def hits(self) -> Tensor:
        """The accuracy."""
        return self.accuracy


def losses(config: SphereNetConfig, output: SphereOutput, targets: SphereTargets) -> SphereLosses:
    """Loss of an output on the keypoint pairs of a step, on unit descriptors: the source's are the anchors."""
    anchors = F.normalize(output.source[targets.source], dim=1)
    partners = F.normalize(output.target[targets.target], dim=1)
    return hardest_in_batch(anchors, partners, config.positive_margin, config.negative_margin)


def hardest_in_batch(
    anchors: Tensor, partners: Tensor, positive_margin: float, negative_margin: float
) -> SphereLosses:
    """``[d_ii - positive]+ + [negative - min d_ij]+``, averaged over anchors alone (loss/desc_loss.py).

    Parameters
    ----------
    anchors, partners
        (n, d) unit descriptors; row i of both is one place. Nearby places are negatives like all others, although
        the original has a (never used) radius for them. With one pair or none there is no negative, and no loss.
    """
    if len(anchors) < 2:
        return SphereLosses((anchors.sum() + partners.sum()) * 0.0, anchors.new_zeros(()))
    distance = distances(anchors, partners)
    itself = torch.eye(len(anchors), device=distance.device, dtype=distance.dtype)
    right = (distance * itself).amax(1)
    wrong = (distance + _ITSELF * itself).amin(1)
    loss = (right - positive_margin).clamp_min(0.0) + (negative_margin - wrong).clamp_min(0.0)
    return SphereLosses(loss.mean(), (right < wrong).to(loss.dtype).mean())


def distances(first: Tensor, second: Tensor) -> Tensor:
    """Euclidean distances (n, m) of (n, d) and (m, d), by differences."""
    return ((first[:, None] - second[None]).square().sum(-1) + _EPS).sqrt()
