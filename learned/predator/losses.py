# SPDX-License-Identifier: MIT
"""Predator's three losses, and the quality of its features (lib/loss.py; docs/methods.md 11.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import torch
from torch import Tensor
from torch.nn import functional as F

from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.losses.circle_loss import circle
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.predator.config import PredatorLossConfig
from hybridreg.learned.predator.targets import PredatorTargets

# Squared distances are clamped to at least this, which also removes their gradient.
_NEAREST = 1e-12
_RECALL = 0.3


class ScoredPoints(Protocol):
    """One cloud, as the losses use it."""

    @property
    def points(self) -> Tensor:
        """(N, 3) metres."""

    @property
    def features(self) -> Tensor:
        """(N, C), length one."""

    @property
    def overlap(self) -> Tensor:
        """(N,) in [0, 1]."""

    @property
    def saliency(self) -> Tensor:
        """(N,) in [0, 1]."""


@dataclass(frozen=True)
class Classification:
    """Scores against labels."""

    loss: Tensor
    precision: Tensor
    recall: Tensor
    labels: Tensor  # (n,) bool


@dataclass(frozen=True, kw_only=True)
class PredatorLosses:
    """The parts of the training loss, and their inputs."""

    circle: Tensor
    overlap: Classification  # over all points, source first
    saliency: Classification  # over the points in the overlap, source first
    recall: Tensor  # share of the drawn points whose nearest drawn feature lies within the positive radius
    config: PredatorLossConfig

    @property
    def total(self) -> Tensor:
        """With the configuration's weights; where it has none for the saliency, the recall of this step switches it."""
        given = self.config.saliency_weight
        return self.weighed(saliency_weight(float(self.recall)) if given is None else given)

    @property
    def parts(self) -> dict[str, Tensor]:
        """Before weighting, for the log."""
        return {"circle": self.circle, "overlap": self.overlap.loss, "saliency": self.saliency.loss}

    @property
    def hits(self) -> Tensor:
        """The recall."""
        return self.recall

    def weighed(self, saliency_weight: float) -> Tensor:
        """The weighted sum, with a weight of the saliency loss from `saliency_weight`."""
        total = self.config.circle_weight * self.circle + self.config.overlap_weight * self.overlap.loss
        # Not times 0: an unused loss that is not finite must not spoil the others.
        return total + saliency_weight * self.saliency.loss if saliency_weight else total


def saliency_weight(recall: float) -> float:
    """Weight of the saliency loss, by a recall (lib/trainer.py).

    It is switched, not faded in: 0 up to a recall of 0.3, 1 above, and 0 again if the recall falls. The original uses
    the validation recall of the previous epoch; `PredatorLosses.total` uses the step's own, so that a resumed run
    needs no state.
    """
    return 1.0 if recall > _RECALL else 0.0


def predator_losses(
    clouds: tuple[ScoredPoints, ScoredPoints], targets: PredatorTargets, config: PredatorLossConfig
) -> PredatorLosses:
    """Losses of a pair, ready for ``backward``; finite for pairs without overlap too.

    Parameters
    ----------
    clouds
        Target and source, as a forward pass gives them.
    targets
        Of the pair's true pose.
    """
    target, source = clouds
    moved = apply_transform(source.points, targets.transform)
    inside = [_marked(len(source.points), targets.source), _marked(len(target.points), targets.target)]
    overlap = _classify(torch.cat([source.overlap, target.overlap]), torch.cat(inside))
    rows = (inside[0].nonzero()[:, 0], inside[1].nonzero()[:, 0])
    good = matchable((source.features, target.features), (moved, target.points), rows, config)
    scores = torch.cat([source.saliency[rows[0]], target.saliency[rows[1]]])
    saliency = _classify(scores, torch.cat(good))
    at, to = targets.drawn_source, targets.drawn_target
    near = point_distances(moved[at], target.points[to])
    apart = feature_distances(source.features[at], target.features[to])
    positive, negative = near < config.positive_radius, near > config.safe_radius
    return PredatorLosses(
        circle=circle(apart, positive, negative, config),
        overlap=overlap,
        saliency=saliency,
        recall=_recall(near, apart, config.positive_radius),
        config=config,
    )


def matchable(
    features: tuple[Tensor, Tensor],
    points: tuple[Tensor, Tensor],
    rows: tuple[Tensor, Tensor],
    config: PredatorLossConfig,
) -> tuple[Tensor, Tensor]:
    """Which points in the overlap have their best match, by the current features, within the matchability radius.

    Parameters
    ----------
    features, points
        (N, C), (M, C) and (N, 3), (M, 3) of source and target in one frame.
    rows
        (n,), (m,) the points in the overlap, among which the best match is sought.

    Returns
    -------
    labels
        (n,), (m,) bool.
    """
    if len(rows[0]) == 0 or len(rows[1]) == 0:
        return rows[0].new_zeros(len(rows[0]), dtype=torch.bool), rows[1].new_zeros(
            len(rows[1]), dtype=torch.bool
        )
    likeness = features[0].detach()[rows[0]] @ features[1].detach()[rows[1]].t()
    source, target = points[0][rows[0]], points[1][rows[1]]
    to_target = (source - target[likeness.argmax(1)]).norm(dim=1)
    to_source = (target - source[likeness.argmax(0)]).norm(dim=1)
    return to_target < config.matchability_radius, to_source < config.matchability_radius


def point_distances(source: Tensor, target: Tensor) -> Tensor:
    """(n, 3), (m, 3) to (n, m) metres, by the expanded square: no distance is below 1e-6."""
    return squared_distances(source, target).clamp_min(_NEAREST).sqrt()


def feature_distances(source: Tensor, target: Tensor) -> Tensor:
    """(n, C), (m, C) of length one to (n, m)."""
    return (2.0 - 2.0 * source @ target.t()).clamp_min(_NEAREST).sqrt()


def _marked(count: int, rows: Tensor) -> Tensor:
    marked = torch.zeros(count, dtype=torch.bool, device=rows.device)
    marked[rows] = True
    return marked


def _classify(scores: Tensor, labels: Tensor) -> Classification:
    # Each class is weighted by the other's share, and the weights are not normalised: where nearly all labels are one,
    # the loss is small.
    wanted = labels.to(scores.dtype)
    if len(labels) == 0:
        nothing = scores.sum()
        return Classification(nothing, nothing.detach(), nothing.detach(), labels)
    share = wanted.mean()
    weight = torch.where(labels, 1.0 - share, share)
    said = scores.detach().round() > 0
    hits = (said & labels).sum()
    return Classification(
        (weight * F.binary_cross_entropy(scores, wanted, reduction="none")).mean(),
        hits / said.sum().clamp_min(1),
        hits / labels.sum().clamp_min(1),
        labels,
    )


def _recall(near: Tensor, apart: Tensor, radius: float) -> Tensor:
    if near.numel() == 0:
        return near.new_zeros(())
    able = (near < radius).any(1)
    found = near.gather(1, apart.detach().argmin(1, keepdim=True))[:, 0] < radius
    return (found & able).sum() / able.sum().clamp_min(1)
