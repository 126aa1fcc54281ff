# SPDX-License-Identifier: MIT
"""The weighted losses of a phase for one sample; losses without weight are not computed."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.cross3dreg.encodings import Encoding, Known
from hybridreg.learned.cross3dreg.losses import mask_loss, overlap_matrix
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.superpoint_mask import Kept
from hybridreg.learned.cross3dreg.training_mask import MaskJitter
from hybridreg.learned.cross3dreg.training_step import fine_loss, keep_for_training
from hybridreg.learned.losses.circle_loss import circle_loss
from hybridreg.learned.losses.infonce_loss import InfoNceConfig, infonce
from hybridreg.learned.training.data.samples import Sample
from hybridreg.learned.training.recipe import LossWeights


@dataclass(frozen=True, kw_only=True)
class Matched:
    """The matcher's result for a sample, for the log."""

    encoding: Encoding
    kept: tuple[Kept, Kept]
    features: tuple[Tensor, Tensor]


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """Losses by name before weighting, their weighted sum, and figures for the log."""

    total: Tensor
    parts: dict[str, Tensor]
    hits: Tensor | None = None
    matched: Matched | None = None


def objective(
    network: RegistrationNetwork,
    sample: Sample,
    weights: LossWeights,
    contrast: InfoNceConfig,
    jitter: MaskJitter,
    generator: torch.Generator,
    known: Known | None = None,
) -> Outcome:
    """Losses of a sample, ready for ``backward``. The network must be in training mode.

    ``known`` is the backbone's output for this sample, where that is known.
    """
    hits: Tensor | None = None
    if not weights.matcher:
        points, features = fine_features(network, sample, known)
        loss, hits = contrastive_loss(network, sample, points, features, contrast, generator)
        return Outcome(total=weights.infonce * loss, parts={"infonce": loss}, hits=hits)
    encoding = network.encode(sample.batch, known)
    parts: dict[str, Tensor] = {}
    if weights.infonce:
        points = (encoding.target.points, encoding.source.points)
        features = (encoding.target.point_features, encoding.source.point_features)
        parts["infonce"], hits = contrastive_loss(network, sample, points, features, contrast, generator)
    overlap = network.predict_overlap(encoding)
    if weights.mask and overlap is not None:
        parts["mask"] = mask_loss(overlap, sample.targets, network.config.loss)
    matched = None
    if weights.coarse:
        kept = keep_for_training(network, encoding, overlap, sample.targets, jitter, generator)
        matched = Matched(encoding=encoding, kept=kept, features=network.attend(encoding, kept))
        truth = overlap_matrix(sample.targets, kept)
        parts["coarse"] = circle_loss(*matched.features, truth, network.config.loss)
    if weights.fine:
        parts["fine"] = fine_loss(network, encoding, sample.targets, generator)
    total = torch.stack([getattr(weights, name) * loss for name, loss in parts.items()]).sum()
    return Outcome(total=total, parts=parts, hits=hits, matched=matched)


def contrastive_loss(
    network: RegistrationNetwork,
    sample: Sample,
    points: tuple[Tensor, Tensor],
    features: tuple[Tensor, Tensor],
    contrast: InfoNceConfig,
    generator: torch.Generator,
) -> tuple[Tensor, Tensor]:
    """InfoNCE from source to target and optionally back; and the share of anchors that find their correspondence."""
    voxel = network.config.backbone.voxel
    forth = infonce(features[1], features[0], points[0], sample.partners[1], contrast, voxel, generator)
    if not contrast.symmetric:
        return forth.loss, forth.hits
    back = infonce(features[0], features[1], points[1], sample.partners[0], contrast, voxel, generator)
    return (forth.loss + back.loss) / 2, (forth.hits + back.hits) / 2


def fine_features(
    network: RegistrationNetwork, sample: Sample, known: Known | None = None
) -> tuple[tuple[Tensor, Tensor], tuple[Tensor, Tensor]]:
    """Fine points and their features from the backbone alone, target first."""
    pyramid = sample.batch.pyramid
    stage = network.config.backbone.fine_stage - 1
    fine = known.fine if known else network.backbone(sample.batch.features, pyramid)[1]
    target, source = fine.split(list(pyramid.lengths[stage]))
    return pyramid.clouds(stage), (target, source)
