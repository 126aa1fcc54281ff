# SPDX-License-Identifier: MIT
"""Predator's recording: labels and drawn pairs, but for what ties decide."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import torch
from arrays import Found
from stacked import TIE
from torch import Tensor

from hybridreg.learned.predator.config import PredatorLossConfig
from hybridreg.learned.predator.losses import matchable
from hybridreg.learned.predator.targets import PredatorTargets, candidates

# Inner products of unit features that agree to some digits of float32: the best match may be either.
_LIKENESS_TIE = 1e-5


def drawn_apart(
    targets: PredatorTargets,
    source: Tensor,
    target: Tensor,
    config: PredatorLossConfig,
    want: Tensor,
    prefix: str,
) -> Found:
    # Which pairs were drawn is chance: that they could be, and how many, is not.
    able = candidates(source, target, (targets.source, targets.target), config)
    pairs = {(int(s), int(t)) for s, t in zip(targets.source[able], targets.target[able], strict=True)}
    drawn = {(int(s), int(t)) for s, t in want}
    at, to = want.long().t()
    near = (source[at] - target[to]).norm(dim=1) < config.positive_radius - config.positive_slack + TIE
    strange = sum(
        not ok for pair, ok in zip(want.tolist(), near.tolist(), strict=True) if tuple(pair) not in pairs
    )
    missing = min(config.max_points, len(pairs)) - len(drawn)
    tied = int(
        (
            (source[targets.source] - target[targets.target]).norm(dim=1)
            - config.positive_radius
            + config.positive_slack
        )
        .abs()
        .lt(TIE)
        .sum()
    )
    return {f"{prefix}selected_correspondences": (float(strange + max(0, abs(missing) - tied)), 0.0)}


def labels_unequal(ours: Tensor, want: Tensor) -> tuple[float, float]:
    same = ours.shape == want.shape
    return (float((ours.long() != want.long()).sum()) if same else math.inf), 0.0


@dataclass(frozen=True)
class Sides:
    features: tuple[Tensor, Tensor]
    points: tuple[Tensor, Tensor]
    rows: tuple[Tensor, Tensor]


def labels_apart(
    clouds: Any,
    points: tuple[Tensor, Tensor],
    targets: PredatorTargets,
    config: PredatorLossConfig,
    want: Tensor,
) -> tuple[float, float]:
    """Labels that differ, but for distances within 1e-5 m of the radius and best matches that are tied."""
    rows = (targets.source.unique(), targets.target.unique())
    features = (clouds[0].features, clouds[1].features)
    ours = torch.cat(matchable(features, points, rows, config))
    if ours.shape != want.shape:
        return math.inf, 0.0
    tied = tied_labels(Sides(features, points, rows), config)
    return float(((ours != want.bool()) & ~tied).sum()), 0.0


def tied_labels(sides: Sides, config: PredatorLossConfig) -> Tensor:
    likeness = sides.features[0][sides.rows[0]] @ sides.features[1][sides.rows[1]].t()
    source, target = sides.points[0][sides.rows[0]], sides.points[1][sides.rows[1]]
    parts = []
    for scores, own, other in ((likeness, source, target), (likeness.t(), target, source)):
        best = scores.topk(min(2, scores.shape[1]), 1)
        near = (own - other[best.indices[:, 0]]).norm(dim=1)
        close = best.values[:, 0] - best.values[:, -1] < _LIKENESS_TIE if scores.shape[1] > 1 else near < 0
        parts.append(close | ((near - config.matchability_radius).abs() < TIE))
    return torch.cat(parts)
