# SPDX-License-Identifier: MIT
"""The hardest-contrastive loss (Choy et al. 2019, equation 4), as released and as printed (docs/methods.md 11.1)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.fcgf.config import FcgfLossConfig
from hybridreg.learned.fcgf.targets import FcgfTargets


@dataclass(frozen=True, kw_only=True)
class Mined:
    """The hardest candidate of each anchor on one side."""

    row: Tensor  # (P,) of the candidate among all voxels of that side
    distance: Tensor  # (P,) of features, with gradient
    negative: Tensor  # (P,) bool: false where anchor and candidate are a known positive


@dataclass(frozen=True, kw_only=True)
class HardestContrastive:
    """Both terms before weighting, and what was mined."""

    positive: Tensor
    negative: Tensor  # mean of the two sides
    in_target: Mined
    in_source: Mined


def hardest_contrastive(
    source: Tensor, target: Tensor, targets: FcgfTargets, config: FcgfLossConfig
) -> HardestContrastive:
    """Pull the drawn positives together, push each of their points from its nearest candidate on the other side.

    A candidate counts unless it and the anchor are literally in the list of positives: one just outside the search
    radius is a valid negative, and so is one of another pair of the batch (lib/trainer.py 404-453).

    Parameters
    ----------
    source, target
        (N, C), (M, C) features.
    targets
        Positives and what was drawn from them, of the same batch.

    Returns
    -------
    HardestContrastive
        A term without any member is 0 and keeps the graph; the published code gives NaN.
    """
    drawn = targets.positives[targets.anchors]
    anchors = source[drawn[:, 0]], target[drawn[:, 1]]
    in_target = _mine(anchors[0], target, targets.target_candidates, config)
    in_source = _mine(anchors[1], source, targets.source_candidates, config)
    known = _key(targets.positives[:, 0], targets.positives[:, 1], len(target))
    in_target = _judged(in_target, _key(drawn[:, 0], in_target.row, len(target)), known)
    in_source = _judged(in_source, _key(in_source.row, drawn[:, 1], len(target)), known)
    squares = (anchors[0] - anchors[1]).square().sum(1)
    if config.form == "released":
        pulled = (squares - config.positive_margin).relu()
    else:
        pulled = ((squares + config.distance_eps).sqrt() - config.positive_margin).relu().square()
    sides = [_pushed(mined, config) for mined in (in_target, in_source)]
    return HardestContrastive(
        positive=_mean(pulled), negative=(sides[0] + sides[1]) / 2, in_target=in_target, in_source=in_source
    )


def _mine(anchor: Tensor, side: Tensor, candidates: Tensor, config: FcgfLossConfig) -> Mined:
    among = side[candidates]
    # Differences, not a matrix product: features may have any length, and equal ones must give exactly 0.
    apart = torch.cdist(anchor.detach(), among.detach(), compute_mode="donot_use_mm_for_euclid_dist")
    best = apart.argmin(1)
    distance = ((anchor - among[best]).square().sum(1) + config.distance_eps).sqrt()
    return Mined(row=candidates[best], distance=distance, negative=torch.ones_like(best, dtype=torch.bool))


def _key(source: Tensor, target: Tensor, n_target: int) -> Tensor:
    return source * n_target + target


def _judged(mined: Mined, key: Tensor, known: Tensor) -> Mined:
    return Mined(row=mined.row, distance=mined.distance, negative=~torch.isin(key, known))


def _pushed(mined: Mined, config: FcgfLossConfig) -> Tensor:
    return _mean((config.negative_margin - mined.distance[mined.negative]).relu().square())


def _mean(values: Tensor) -> Tensor:
    return values.mean() if len(values) else values.sum()
