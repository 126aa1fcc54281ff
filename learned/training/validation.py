# SPDX-License-Identifier: MIT
"""Validation by the evaluator's own scoring: LGR without refinement, protocol `cross3dreg`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional as F

from hybridreg.eval.run.row import Row, matrix
from hybridreg.eval.score import metrics
from hybridreg.eval.score.protocols import protocol
from hybridreg.eval.score.scoring import score
from hybridreg.learned.cross3dreg.config import OmpConfig
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.targets import Targets
from hybridreg.learned.matching.local_to_global import local_to_global
from hybridreg.learned.matching.superpoint_matching import SuperpointMatches
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.training.data.opened_source import OpenedSource
from hybridreg.learned.training.data.pair_source import PairSource
from hybridreg.learned.training.data.samples import Sample, undisturbed
from hybridreg.learned.training.stage_validation import rows_of
from hybridreg.learned.training.steps.objective import fine_features

PROTOCOL = protocol("cross3dreg")


@dataclass(frozen=True, kw_only=True)
class Validation:
    """Figures of one validation set; NaN where a phase has nothing to measure.

    Attributes
    ----------
    recall, inlier_ratio : of the whole network; in a warm-up by InfoNCE the inlier ratio of mutual nearest
        neighbours among the fine features, and no recall
    pir : share of matched superpoints whose patches overlap
    mask_f1 : of the overlap mask
    """

    title: str
    pairs: int
    recall: float
    rre_deg: float
    rte_m: float
    inlier_ratio: float
    pir: float
    mask_f1: float


def validate(network: Pretrained, source: OpenedSource, *, matcher: bool, device: torch.device) -> Validation:
    """Figures of a network on one source; ``matcher`` false evaluates the fine features alone."""
    if isinstance(source, PairSource):
        assert isinstance(network, RegistrationNetwork)
        return _validate_prepared(network, source, matcher=matcher, device=device)
    pairs = [(source.ids[index], source.pairs[index]) for index in source.usable]
    rows = rows_of(network, pairs, device, PROTOCOL)
    return _figures(source.title, rows, [], [], matcher=True)


@torch.inference_mode()
def _validate_prepared(
    network: RegistrationNetwork, source: PairSource, *, matcher: bool, device: torch.device
) -> Validation:
    network.eval()
    rows, pirs, masks = [], [], []
    for number in range(len(source)):
        sample = undisturbed(source.load(number), source.config.image).to(device)
        if matcher:
            row, pir, mask = _matched(network, sample, number)
            pirs.append(pir)
            masks += mask
        else:
            row = _described(network, sample, number)
        rows.append(row)
    network.train()
    return _figures(source.title, rows, pirs, masks, matcher=matcher)


def _figures(
    title: str, rows: Sequence[Row], pirs: Sequence[float], masks: Sequence[float], *, matcher: bool
) -> Validation:
    result = score(rows, PROTOCOL)
    return Validation(
        title=title,
        pairs=len(rows),
        recall=result.recall if matcher else float("nan"),
        rre_deg=result.rre_deg_median if matcher else float("nan"),
        rte_m=result.rte_m_median if matcher else float("nan"),
        inlier_ratio=result.inlier_ratio,
        pir=_mean(pirs),
        mask_f1=_mean(masks),
    )


def rank(found: Sequence[Validation], matcher: bool) -> tuple[float, ...]:
    """Ranking of validations: recall, then inlier ratio; any matcher beats a warm-up.

    For a network without matches the smaller rotation error is better.
    """
    recall = _mean([each.recall for each in found]) if matcher else 0.0
    ratio = _mean([each.inlier_ratio for each in found])
    if np.isnan(ratio):
        error = _mean([each.rre_deg for each in found])
        ratio = -180.0 if np.isnan(error) else -error
    return (float(matcher), round(recall, 9), ratio)


def pair_inlier_ratio(superpoints: SuperpointMatches, targets: Targets) -> float:
    """PIR: share of superpoint matches whose patches overlap under the true pose (docs/methods.md 1.3)."""
    if len(superpoints) == 0:
        return 0.0
    columns = len(targets.mask_source)
    true = targets.target * columns + targets.source
    return float(torch.isin(superpoints.target * columns + superpoints.source, true).float().mean())


def _matched(network: RegistrationNetwork, sample: Sample, number: int) -> tuple[Row, float, list[float]]:
    output = network(sample.batch)
    matches, targets = output.matches, sample.targets
    T = None
    if len(matches) >= 3:
        arguments = (matches.target.double(), matches.source.double(), matches.weight.double(), matches.group)
        T = local_to_global(*arguments, network.config.lgr).transform.cpu().numpy()
    masks = (
        []
        if output.overlap is None
        else [_mask_f1(output.overlap.target, output.overlap.source, targets, network.config.omp)]
    )
    row = _row(sample, number, matches.source, matches.target, T)
    return row, pair_inlier_ratio(output.superpoints, targets), masks


def _described(network: RegistrationNetwork, sample: Sample, number: int) -> Row:
    points, features = fine_features(network, sample)
    target, source = (F.normalize(each, dim=1) for each in features)
    scores = source @ target.t()
    best, back = scores.argmax(1), scores.argmax(0)
    mutual = (back[best] == torch.arange(len(best), device=best.device)).nonzero()[:, 0]
    return _row(sample, number, points[1][mutual], points[0][best[mutual]], None)


def _row(sample: Sample, number: int, source: Tensor, target: Tensor, T: np.ndarray | None) -> Row:
    truth = sample.targets.transform.cpu().double().numpy()
    ratio = metrics.inlier_ratio(
        source.cpu().double().numpy(), target.cpu().double().numpy(), truth, PROTOCOL.inlier_m
    )
    return Row(
        index=number,
        id=sample.id,
        T=None if T is None else matrix(T),
        T_true=matrix(truth),
        n_matches=len(source),
        inlier_ratio={f"{PROTOCOL.inlier_m:g}": ratio},
    )


def _mask_f1(target: Tensor, source: Tensor, targets: Targets, config: OmpConfig | None) -> float:
    # At the threshold that the matching applies, so that one number means one thing.
    threshold = (config or OmpConfig()).threshold
    predicted = torch.sigmoid(torch.cat([target, source])).cpu().numpy() > threshold
    truth = torch.cat([targets.mask_target, targets.mask_source]).cpu().numpy()
    return metrics.mask_scores(predicted, truth).f1


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if len(values) else float("nan")
