# SPDX-License-Identifier: MIT
"""Predator against its recording: every block, the scores, the losses on them and alone, and gradients."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from arrays import apart, read_plan, read_weights
from stacked import (
    FEATURES,
    TIE,
    EncoderOutputs,
    Found,
    backbone_config,
    complete,
    decoder_outputs,
    gradients_apart,
    held,
    norms_apart,
    read_batch,
    recorded_order,
)
from torch import Tensor

from hybridreg.learned.batch import Batch
from hybridreg.learned.kpfcnn_names import load_stacked
from hybridreg.learned.predator.config import GraphConfig, PredatorConfig, PredatorLossConfig
from hybridreg.learned.predator.graph import nearest_others
from hybridreg.learned.predator.losses import (
    PredatorLosses,
    feature_distances,
    matchable,
    point_distances,
    predator_losses,
)
from hybridreg.learned.predator.network import PredatorCloud, PredatorNetwork
from hybridreg.learned.predator.official_names import official_name
from hybridreg.learned.predator.targets import PredatorTargets, candidates
from hybridreg.learned.procrustes import apply_transform

LOSS = 1e-4
# Inner products of unit features that agree to some digits of float32: the best match may be either.
_LIKENESS_TIE = 1e-5
# Metres: the expanded square's rounding at the clouds' distance from the origin.
_KNN_TIE = 1e-3


def compare(stem: Path) -> Found:
    """Largest difference and tolerance by recorded output."""
    plan = read_plan(stem)
    with np.load(stem.with_name(f"{stem.name}.npz")) as arrays:
        want = {name: torch.from_numpy(np.array(arrays[name])) for name in arrays.files}
    config = network_config(plan)
    network = PredatorNetwork(config)
    load_stacked(network, read_weights(stem), stem.name, official_name)
    batch = read_batch(want, config.backbone.stages)
    with torch.no_grad():
        found = held(block_outputs(network.eval(), batch), want, "out.") | _neighbors(batch, config, want)
        found |= _losses(network, batch, want, "loss.")
    found |= _training(network, batch, want, plan)
    found |= _alone(want, config.loss)
    return complete(found, want, ("in.", "synth.in."))


def network_config(plan: Mapping[str, Any]) -> PredatorConfig:
    """Our configuration of a recorded plan."""
    graph, loss = plan["gnn"], plan["loss"]
    return PredatorConfig(
        backbone=backbone_config(plan),
        graph=GraphConfig(
            dim=graph["dim"], neighbors=graph["k"], heads=graph["heads"], blocks=tuple(graph["blocks"])
        ),
        final_dim=plan["final_dim"],
        cross_score=plan["cross_score"],
        condition_feature=plan["condition_feature"],
        temperature_floor=plan["temperature_floor"],
        loss=PredatorLossConfig(
            positive_margin=loss["positive_margin"],
            negative_margin=loss["negative_margin"],
            positive_optimal=loss["positive_optimal"],
            negative_optimal=loss["negative_optimal"],
            log_scale=loss["log_scale"],
            positive_radius=loss["positive_radius"],
            positive_slack=loss["positive_radius_slack"],
            safe_radius=loss["safe_radius"],
            overlap_radius=loss["overlap_radius"],
            matchability_radius=loss["matchability_radius"],
            max_points=loss["max_points"],
            circle_weight=loss["w_circle"],
            overlap_weight=loss["w_overlap"],
        ),
    )


def block_outputs(network: PredatorNetwork, batch: Batch) -> dict[str, Tensor]:
    """Everything that a forward pass computes, by the recording's names and in its order."""
    pyramid, last = batch.pyramid, batch.pyramid.stages - 1
    with EncoderOutputs(network.encoder, pyramid) as seen:
        coarse, skips = network.encoder(batch.features, pyramid)
    before = network.bottleneck(coarse)
    target, source = before.split(list(pyramid.lengths[-1]))
    points = pyramid.clouds(last)
    for index, clouds in enumerate(network.graph.steps((source, target), (points[1], points[0]))):
        seen[f"gnn.{index}.src"], seen[f"gnn.{index}.ref"] = clouds
    features = network.project(network.mix(before, pyramid))
    score = network.score(features)
    decoded = network.decoder_input(before, features, score, pyramid)
    whole = {"bottle": before, "proj_gnn": features, "scores_c": score, "decoder_input": decoded}
    whole["scores_cross_c"] = network.cross_score(features, score, pyramid)
    seen |= {name: recorded_order(rows, pyramid, last) for name, rows in whole.items()}
    seen |= decoder_outputs(network.decoder, decoded, skips, pyramid)
    output = network(batch)
    clouds = (output.source, output.target)
    seen["feats"] = torch.cat([cloud.features for cloud in clouds])
    seen["scores_overlap"] = torch.cat([cloud.overlap for cloud in clouds])
    seen["scores_saliency"] = torch.cat([cloud.saliency for cloud in clouds])
    seen["sample_prob_src"], seen["sample_prob_ref"] = (cloud.sampling for cloud in clouds)
    return seen


def _neighbors(batch: Batch, config: PredatorConfig, want: Mapping[str, Tensor]) -> Found:
    """Metres by which neighbours that are not in both sets differ in distance."""
    found: Found = {}
    for name, cloud in zip(("ref", "src"), batch.pyramid.clouds(batch.pyramid.stages - 1), strict=True):
        key = f"out.gnn_knn.{name}"
        if key in want:
            ours, theirs = nearest_others(cloud, config.graph.neighbors), want[key].long()
            if ours.shape != theirs.shape:
                found[key] = (math.inf, 0.0)
                continue
            away = torch.cdist(cloud, cloud, compute_mode="donot_use_mm_for_euclid_dist")
            sorted_ours, sorted_theirs = ours.sort(1).values, theirs.sort(1).values
            rows = (sorted_ours != sorted_theirs).any(1)
            lengths = [away[rows].gather(1, each[rows]).sort(1).values for each in (ours, theirs)]
            found[key] = (apart(*lengths), _KNN_TIE)
    return found


def _targets(want: Mapping[str, Tensor], prefix: str, pairs: str, transform: Tensor) -> PredatorTargets:
    every, drawn = want[pairs].long(), want[f"{prefix}selected_correspondences"].long()
    return PredatorTargets(
        transform=transform,
        source=every[:, 0],
        target=every[:, 1],
        drawn_source=drawn[:, 0],
        drawn_target=drawn[:, 1],
    )


def _losses(network: PredatorNetwork, batch: Batch, want: Mapping[str, Tensor], prefix: str) -> Found:
    output, config = network(batch), network.config.loss
    targets = _targets(want, prefix, "in.correspondences", want["in.transform"])
    losses = network.losses(output, targets)
    found = {f"{prefix}out.{name}": (apart(value, want[f"{prefix}out.{name}"]), LOSS) for name, value in _parts(losses).items()}
    moved = apply_transform(output.source.points, targets.transform)
    found |= _drawn(targets, moved, output.target.points, config, want[f"{prefix}selected_correspondences"], prefix)
    found[f"{prefix}overlap_labels"] = _unequal(losses.overlap.labels, want[f"{prefix}overlap_labels"])
    for name, rows in (("src", targets.source.unique()), ("ref", targets.target.unique())):
        found[f"{prefix}saliency_points_{name}"] = _unequal(rows, want[f"{prefix}saliency_points_{name}"])
    labels = _labels_apart((output.source, output.target), (moved, output.target.points), targets, config, want[f"{prefix}saliency_labels"])
    return found | {f"{prefix}saliency_labels": labels}


def _drawn(targets: PredatorTargets, source: Tensor, target: Tensor, config: PredatorLossConfig, want: Tensor, prefix: str) -> Found:
    # Which pairs were drawn is chance: that they could be, and how many, is not.
    able = candidates(source, target, (targets.source, targets.target), config)
    pairs = {(int(s), int(t)) for s, t in zip(targets.source[able], targets.target[able], strict=True)}
    drawn = {(int(s), int(t)) for s, t in want}
    at, to = want.long().t()
    near = (source[at] - target[to]).norm(dim=1) < config.positive_radius - config.positive_slack + TIE
    strange = sum(not ok for pair, ok in zip(want.tolist(), near.tolist(), strict=True) if tuple(pair) not in pairs)
    missing = min(config.max_points, len(pairs)) - len(drawn)
    tied = int(((source[targets.source] - target[targets.target]).norm(dim=1) - config.positive_radius + config.positive_slack).abs().lt(TIE).sum())
    return {f"{prefix}selected_correspondences": (float(strange + max(0, abs(missing) - tied)), 0.0)}


def _unequal(ours: Tensor, want: Tensor) -> tuple[float, float]:
    same = ours.shape == want.shape
    return (float((ours.long() != want.long()).sum()) if same else math.inf), 0.0


@dataclass(frozen=True)
class _Sides:
    features: tuple[Tensor, Tensor]
    points: tuple[Tensor, Tensor]
    rows: tuple[Tensor, Tensor]


def _labels_apart(clouds: Any, points: tuple[Tensor, Tensor], targets: PredatorTargets, config: PredatorLossConfig, want: Tensor) -> tuple[float, float]:
    """Labels that differ, but for distances within 1e-5 m of the radius and best matches that are tied."""
    rows = (targets.source.unique(), targets.target.unique())
    features = (clouds[0].features, clouds[1].features)
    ours = torch.cat(matchable(features, points, rows, config))
    if ours.shape != want.shape:
        return math.inf, 0.0
    tied = _tied(_Sides(features, points, rows), config)
    return float(((ours != want.bool()) & ~tied).sum()), 0.0


def _tied(sides: _Sides, config: PredatorLossConfig) -> Tensor:
    likeness = sides.features[0][sides.rows[0]] @ sides.features[1][sides.rows[1]].t()
    source, target = sides.points[0][sides.rows[0]], sides.points[1][sides.rows[1]]
    parts = []
    for scores, own, other in ((likeness, source, target), (likeness.t(), target, source)):
        best = scores.topk(min(2, scores.shape[1]), 1)
        near = (own - other[best.indices[:, 0]]).norm(dim=1)
        close = best.values[:, 0] - best.values[:, -1] < _LIKENESS_TIE if scores.shape[1] > 1 else near < 0
        parts.append(close | ((near - config.matchability_radius).abs() < TIE))
    return torch.cat(parts)


def _parts(losses: PredatorLosses) -> dict[str, Tensor]:
    parts = {"circle_loss": losses.circle, "recall": losses.recall}
    for name, part in (("overlap", losses.overlap), ("saliency", losses.saliency)):
        parts |= {f"{name}_loss": part.loss, f"{name}_precision": part.precision, f"{name}_recall": part.recall}
    return parts


def _training(network: PredatorNetwork, batch: Batch, want: Mapping[str, Tensor], plan: Mapping[str, Any]) -> Found:
    targets = _targets(want, "loss.", "in.correspondences", want["in.transform"])
    names = {name: official_name(name) for name in network.state_dict()}
    weights = {key.split(".")[1]: float(key.split(".")[1].rpartition("_")[2]) for key in want if key.startswith("train.w_saliency_")}
    found: Found = {}
    for name, weight in weights.items():
        prefix = f"train.{name}."
        network.train().zero_grad(set_to_none=True)
        losses = network.losses(network(batch), targets)
        total = losses.weighed(weight)
        total.backward()  # type: ignore[no-untyped-call]
        parts = _parts(losses) | {"total": total}
        found |= {f"{prefix}{part}": (apart(value, want[f"{prefix}{part}"]), LOSS) for part, value in parts.items()}
        found |= gradients_apart(network, names, want, prefix)
        key = f"{prefix}grad_norm"
        found[key] = norms_apart(network, names, plan["train_grad_norm_names"], want[key])
    network.eval().zero_grad(set_to_none=True)
    return found


def _alone(want: Mapping[str, Tensor], config: PredatorLossConfig) -> Found:
    """The losses on recorded features and scores."""
    if "synth.in.src_feats" not in want:
        return {}
    count = len(want["synth.in.src_points"])
    sides = [want[f"synth.in.{name}"].clone().requires_grad_() for name in ("src_feats", "ref_feats")]
    scores = [want[f"synth.in.scores_{name}"].clone().requires_grad_() for name in ("overlap", "saliency")]
    points = (want["synth.in.src_points"], want["synth.in.ref_points"])
    source, target = (
        PredatorCloud(points=points[side], features=sides[side], overlap=scores[0][part], saliency=scores[1][part])
        for side, part in enumerate((slice(None, count), slice(count, None)))
    )
    targets = _targets(want, "synth.", "synth.in.correspondences", want["in.transform"])
    losses = predator_losses((target, source), targets, config)
    found = {f"synth.out.{name}": (apart(value, want[f"synth.out.{name}"]), LOSS) for name, value in _parts(losses).items()}
    moved = apply_transform(points[0], targets.transform)
    found |= _drawn(targets, moved, points[1], config, want["synth.selected_correspondences"], "synth.")
    found["synth.out.overlap_labels"] = _unequal(losses.overlap.labels, want["synth.out.overlap_labels"])
    with torch.no_grad():
        found["synth.out.saliency_labels"] = _labels_apart((source, target), (moved, points[1]), targets, config, want["synth.out.saliency_labels"])
    at, to = targets.drawn_source, targets.drawn_target
    matrices = {"coords_dist": point_distances(moved[at], points[1][to]), "feats_dist": feature_distances(sides[0][at], sides[1][to])}
    for key, expected in want.items():
        for name, matrix in matrices.items():
            if key.startswith(f"synth.out.{name}_first"):
                rows = int(key.rpartition("_first")[2])
                found[key] = (apart(matrix[:rows, :rows], expected), 1e-3 if name == "coords_dist" else FEATURES)
    of_circle = torch.autograd.grad(losses.circle, sides, retain_graph=True)
    found |= {f"synth.out.grad_circle_{side}_feats": (apart(value, want[f"synth.out.grad_circle_{side}_feats"]), LOSS) for side, value in zip(("src", "ref"), of_circle, strict=True)}
    for name, part, score in (("overlap", losses.overlap, scores[0]), ("saliency", losses.saliency, scores[1])):
        key = f"synth.out.grad_{name}_scores"
        found[key] = (apart(torch.autograd.grad(part.loss, score, retain_graph=True)[0], want[key]), LOSS)
    return found
