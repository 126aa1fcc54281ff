# SPDX-License-Identifier: MIT
"""One training step's forward pass: the only place where the truth meets a network (methods 5.4, 7.4)."""

from __future__ import annotations

import torch
from torch import Tensor

from hybridreg.learned.batch import Batch
from hybridreg.learned.losses import Losses, compute_losses
from hybridreg.learned.network import Encoding, RegistrationNetwork
from hybridreg.learned.omp import OverlapLogits
from hybridreg.learned.superpoint_mask import Kept
from hybridreg.learned.targets import Targets
from hybridreg.learned.training_mask import MaskJitter, training_mask


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
        Of the true mask; only looked at when the network has OMP.
    """
    encoding = network.encode(batch)
    overlap = network.predict_overlap(encoding)
    kept = keep_for_training(network, encoding, overlap, targets, jitter or MaskJitter(), generator)
    features = network.attend(encoding, kept)
    config = network.config.loss
    chosen = sample_target_pairs(targets, config.positive_overlap, config.targets, generator)
    pairs = network.pair_up(encoding, targets.target[chosen], targets.source[chosen])
    assignment = network.assign(encoding, pairs, "log", config.training_sinkhorn_iterations)
    return compute_losses(encoding, overlap, kept, features, pairs, assignment, targets, config)


def sample_target_pairs(targets: Targets, min_overlap: float, limit: int, rng: torch.Generator) -> Tensor:
    """Indices (B,) of at most ``limit`` random true superpoint pairs that overlap by over ``min_overlap``.

    Predicted pairs would teach the point matcher that mostly there is nothing to match.
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
    """Superpoints of both clouds that a step works on: the true mask, disturbed; all of them without OMP."""
    if overlap is None:
        return network.keep(encoding, None)
    limit = network.config.matching.max_superpoints
    target = training_mask(targets.mask_target, overlap.target, limit, jitter, generator)
    source = training_mask(targets.mask_source, overlap.source, limit, jitter, generator)
    return target, source
