# SPDX-License-Identifier: MIT
"""One training step's forward pass: this network's parts under the true mask and pose (docs/methods.md 5.4, 7.4)."""

from __future__ import annotations

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.cross3dreg.encodings import Encoding
from hybridreg.learned.cross3dreg.losses import Losses, mask_loss, overlap_matrix
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.overlap_predictor import OverlapLogits
from hybridreg.learned.cross3dreg.superpoint_mask import Kept
from hybridreg.learned.cross3dreg.targets import Targets
from hybridreg.learned.cross3dreg.training_mask import MaskJitter, training_mask
from hybridreg.learned.losses.circle_loss import circle_loss
from hybridreg.learned.losses.fine_loss import assignment_loss


def training_losses(
    network: RegistrationNetwork,
    batch: Batch,
    targets: Targets,
    generator: torch.Generator,
    jitter: MaskJitter | None = None,
) -> Losses:
    """Losses of one pair, ready for ``backward``; finite for pairs without overlap too.

    Parameters
    ----------
    network
        In training mode.
    batch, targets
        The pair and ``compute_targets`` of its true pose.
    generator
        Draws the kept superpoints and the patch pairs.
    jitter
        Of the true mask; only used when the network has OMP.
    """
    encoding = network.encode(batch)
    overlap = network.predict_overlap(encoding)
    kept = keep_for_training(network, encoding, overlap, targets, jitter or MaskJitter(), generator)
    features = network.attend(encoding, kept)
    config = network.config.loss
    return Losses(
        circle_loss(*features, overlap_matrix(targets, kept), config),
        fine_loss(network, encoding, targets, generator),
        mask_loss(overlap, targets, config),
    )


def fine_loss(
    network: RegistrationNetwork, encoding: Encoding, targets: Targets, generator: torch.Generator
) -> Tensor:
    """Fine loss on random true patch pairs (docs/methods.md 7.4)."""
    config = network.config.loss
    chosen = sample_target_pairs(targets, config.positive_overlap, config.targets, generator)
    target, source = targets.target[chosen], targets.source[chosen]
    # The noise of the augmentation may have moved the only point of a patch into another one.
    owning = encoding.target.patches.occupied[target] & encoding.source.patches.occupied[source]
    pairs = network.pair_up(encoding, target[owning], source[owning])
    assignment = network.assign(encoding, pairs, "kernel", config.training_sinkhorn_iterations)
    points = (encoding.target.points, encoding.source.points)
    return assignment_loss(assignment, pairs, *points, targets.transform, config.positive_radius)


def sample_target_pairs(targets: Targets, min_overlap: float, limit: int, rng: torch.Generator) -> Tensor:
    """Indices (B,) of at most ``limit`` random true superpoint pairs that overlap by over ``min_overlap``.

    Predicted pairs would teach the point matcher that most points have no correspondence.
    """
    good = (targets.overlap > min_overlap).nonzero()[:, 0]
    order = torch.randperm(len(good), generator=rng)[:limit]
    return good[order.to(good.device)]


def keep_for_training(
    network: RegistrationNetwork,
    encoding: Encoding,
    overlap: OverlapLogits | None,
    targets: Targets,
    jitter: MaskJitter,
    generator: torch.Generator,
) -> tuple[Kept, Kept]:
    """Superpoints of both clouds that a step keeps: the true mask with jitter; all of them without OMP."""
    if overlap is None:
        return network.keep(encoding, None)
    limit = network.config.matching.max_superpoints
    target = training_mask(targets.mask_target, overlap.target, limit, jitter, generator)
    source = training_mask(targets.mask_source, overlap.source, limit, jitter, generator)
    return target, source
