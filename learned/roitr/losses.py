# SPDX-License-Identifier: MIT
"""RoITr's losses: circle loss on superpoints, negative log-likelihood of the true point assignment (docs/methods.md
11.5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from hybridreg.learned.losses.circle_loss import circle_loss
from hybridreg.learned.losses.fine_loss import assignment_loss
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.roitr.targets import RoitrTargets

if TYPE_CHECKING:
    from hybridreg.learned.roitr.network import RoitrEncoding, RoitrNetwork, RoitrOutput


@dataclass(frozen=True)
class RoitrLosses:
    """The parts of the training loss."""

    coarse: Tensor
    fine: Tensor
    total: Tensor  # with the configuration's weights

    @property
    def parts(self) -> dict[str, Tensor]:
        """Before weighting, for the log."""
        return {"coarse": self.coarse, "fine": self.fine}

    @property
    def hits(self) -> Tensor | None:
        """Not available."""
        return None


def losses(network: RoitrNetwork, output: RoitrOutput | RoitrEncoding, targets: RoitrTargets) -> RoitrLosses:
    """Losses of a training step: the fine part uses the drawn true patch pairs (lib/loss.py).

    The original's validation uses the estimated pairs instead (`validation_losses`): the two fine losses cannot be
    compared.
    """
    pairs = targets.target[targets.drawn], targets.source[targets.drawn]
    return _losses(network, output, targets, pairs)


def validation_losses(network: RoitrNetwork, output: RoitrOutput, targets: RoitrTargets) -> RoitrLosses:
    """Losses with the fine part on the superpoint pairs that the network itself matched."""
    return _losses(network, output, targets, (output.superpoints.target, output.superpoints.source))


def _losses(
    network: RoitrNetwork,
    output: RoitrOutput | RoitrEncoding,
    targets: RoitrTargets,
    nodes: tuple[Tensor, Tensor],
) -> RoitrLosses:
    config, target, source = network.config, output.target, output.source
    overlap = targets.overlap.new_zeros(len(target.nodes), len(source.nodes))
    overlap[targets.target, targets.source] = targets.overlap
    coarse = circle_loss(target.node_features, source.node_features, overlap, config.loss)
    pairs = network.pair_up(target, source, *nodes)
    fine = assignment_loss(
        network.assign(target, source, pairs, "log", config.loss.training_sinkhorn_iterations),
        pairs,
        target.points,
        source.points,
        targets.transform,
        config.loss.positive_radius,
    )
    return RoitrLosses(coarse, fine, config.coarse_weight * coarse + config.fine_weight * fine)


@torch.no_grad()
def right_shares(
    output: RoitrOutput, targets: RoitrTargets, radius: float, overlap: float = 0.0
) -> tuple[float, float]:
    """Share of superpoint matches that overlap by more than ``overlap`` (PIR), and of point matches within ``radius``
    metres under the true pose (IR); 0 where there are none."""
    right = torch.zeros(len(output.target.nodes), len(output.source.nodes), dtype=torch.bool)
    chosen = targets.overlap > overlap
    right[targets.target[chosen].cpu(), targets.source[chosen].cpu()] = True
    pairs, matches = output.superpoints, output.matches
    coarse = right[pairs.target.cpu(), pairs.source.cpu()].float().mean() if len(pairs) else torch.zeros(())
    apart = (apply_transform(matches.source, targets.transform) - matches.target).norm(dim=1)
    fine = (apart < radius).float().mean() if len(matches) else torch.zeros(())
    return float(coarse), float(fine)
