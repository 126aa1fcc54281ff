# SPDX-License-Identifier: MIT
"""Predator's recording: losses, measures and gradients, of the network and alone on recorded features."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import torch
from arrays import Found, apart
from predator_labels import Sides, drawn_apart, labels_apart, labels_unequal, tied_labels
from stacked import FEATURES, gradients_apart, norms_apart
from torch import Tensor

from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.predator.config import PredatorLossConfig
from hybridreg.learned.predator.losses import (
    PredatorLosses,
    feature_distances,
    point_distances,
    predator_losses,
)
from hybridreg.learned.predator.network import PredatorCloud, PredatorNetwork
from hybridreg.learned.predator.official_names import official_name
from hybridreg.learned.predator.targets import PredatorTargets

LOSS = 1e-4


def recorded_targets(
    want: Mapping[str, Tensor], prefix: str, pairs: str, transform: Tensor
) -> PredatorTargets:
    """All recorded true pairs, and those that were drawn."""
    every, drawn = want[pairs].long(), want[f"{prefix}selected_correspondences"].long()
    return PredatorTargets(
        transform=transform,
        source=every[:, 0],
        target=every[:, 1],
        drawn_source=drawn[:, 0],
        drawn_target=drawn[:, 1],
    )


def losses_on_recording(
    network: PredatorNetwork, batch: Batch, want: Mapping[str, Tensor], prefix: str
) -> Found:
    """Losses, measures and labels in evaluation mode."""
    output, config = network(batch), network.config.loss
    targets = recorded_targets(want, prefix, "in.correspondences", want["in.transform"])
    losses = network.losses(output, targets)
    moved = apply_transform(output.source.points, targets.transform)
    flipped = _flipped(losses, (output.source, output.target), (moved, output.target.points), targets, want)
    found = _parts_apart(losses, want, f"{prefix}out.", flipped)
    found |= drawn_apart(
        targets, moved, output.target.points, config, want[f"{prefix}selected_correspondences"], prefix
    )
    found[f"{prefix}overlap_labels"] = labels_unequal(losses.overlap.labels, want[f"{prefix}overlap_labels"])
    for name, rows in (("src", targets.source.unique()), ("ref", targets.target.unique())):
        found[f"{prefix}saliency_points_{name}"] = labels_unequal(
            rows, want[f"{prefix}saliency_points_{name}"]
        )
    labels = labels_apart(
        (output.source, output.target),
        (moved, output.target.points),
        targets,
        config,
        want[f"{prefix}saliency_labels"],
    )
    return found | {f"{prefix}saliency_labels": labels}


def _flipped(
    losses: PredatorLosses,
    clouds: Any,
    points: tuple[Tensor, Tensor],
    targets: PredatorTargets,
    want: Mapping[str, Tensor],
) -> float:
    """Share of the saliency labels that a tie decided otherwise than in the recording: it moves loss and measures."""
    expected = want["loss.saliency_labels"].bool()
    if expected.shape != losses.saliency.labels.shape or not len(expected):
        return 0.0
    odd = losses.saliency.labels != expected
    rows = (targets.source.unique(), targets.target.unique())
    features = (clouds[0].features.detach(), clouds[1].features.detach())
    tied = tied_labels(Sides(features, points, rows), losses.config) if bool(odd.any()) else odd
    # A label counts once in the mean, and among the true ones, of which there may be few.
    return float((odd & tied).sum()) / max(1.0, float(expected.sum()))


def _parts_apart(losses: PredatorLosses, want: Mapping[str, Tensor], prefix: str, flipped: float) -> Found:
    return {
        f"{prefix}{name}": (
            apart(value, want[f"{prefix}{name}"]),
            LOSS + (flipped if name.startswith("saliency") else 0.0),
        )
        for name, value in _parts(losses).items()
    }


def _parts(losses: PredatorLosses) -> dict[str, Tensor]:
    parts = {"circle_loss": losses.circle, "recall": losses.recall}
    for name, part in (("overlap", losses.overlap), ("saliency", losses.saliency)):
        parts |= {
            f"{name}_loss": part.loss,
            f"{name}_precision": part.precision,
            f"{name}_recall": part.recall,
        }
    return parts


def training(
    network: PredatorNetwork, batch: Batch, want: Mapping[str, Tensor], plan: Mapping[str, Any]
) -> Found:
    """Losses, measures and gradients of a training step, with each weight of the saliency loss."""
    targets = recorded_targets(want, "loss.", "in.correspondences", want["in.transform"])
    names = {name: official_name(name) for name in network.state_dict()}
    seen = [re.match(r"train\.(w_saliency_(\d+(?:\.\d+)?))\.", key) for key in want]
    weights = {match[1]: float(match[2]) for match in seen if match}
    found: Found = {}
    for name, weight in weights.items():
        prefix = f"train.{name}."
        network.train().zero_grad(set_to_none=True)
        losses = network.losses(network(batch), targets)
        total = losses.weighed(weight)
        total.backward()  # type: ignore[no-untyped-call]
        clouds, moved = network(batch), apply_transform(batch.pyramid.clouds(0)[1], targets.transform)
        flipped = _flipped(
            losses, (clouds.source, clouds.target), (moved, clouds.target.points), targets, want
        )
        found |= _parts_apart(losses, want, prefix, flipped)
        found[f"{prefix}total"] = (apart(total, want[f"{prefix}total"]), LOSS + flipped * weight)
        found |= gradients_apart(network, names, want, prefix)
        key = f"{prefix}grad_norm"
        found[key] = norms_apart(network, names, plan["train_grad_norm_names"], want[key])
    network.eval().zero_grad(set_to_none=True)
    return found


def losses_alone(want: Mapping[str, Tensor], config: PredatorLossConfig) -> Found:
    """The losses on recorded features and scores."""
    if "synth.in.src_feats" not in want:
        return {}
    count = len(want["synth.in.src_points"])
    sides = [want[f"synth.in.{name}"].clone().requires_grad_() for name in ("src_feats", "ref_feats")]
    scores = [want[f"synth.in.scores_{name}"].clone().requires_grad_() for name in ("overlap", "saliency")]
    points = (want["synth.in.src_points"], want["synth.in.ref_points"])
    source, target = (
        PredatorCloud(
            points=points[side], features=sides[side], overlap=scores[0][part], saliency=scores[1][part]
        )
        for side, part in enumerate((slice(None, count), slice(count, None)))
    )
    targets = recorded_targets(want, "synth.", "synth.in.correspondences", want["in.transform"])
    losses = predator_losses((target, source), targets, config)
    found = {
        f"synth.out.{name}": (apart(value, want[f"synth.out.{name}"]), LOSS)
        for name, value in _parts(losses).items()
    }
    moved = apply_transform(points[0], targets.transform)
    found |= drawn_apart(targets, moved, points[1], config, want["synth.selected_correspondences"], "synth.")
    found["synth.out.overlap_labels"] = labels_unequal(
        losses.overlap.labels, want["synth.out.overlap_labels"]
    )
    with torch.no_grad():
        found["synth.out.saliency_labels"] = labels_apart(
            (source, target), (moved, points[1]), targets, config, want["synth.out.saliency_labels"]
        )
    at, to = targets.drawn_source, targets.drawn_target
    matrices = {
        "coords_dist": point_distances(moved[at], points[1][to]),
        "feats_dist": feature_distances(sides[0][at], sides[1][to]),
    }
    for key, expected in want.items():
        for name, matrix in matrices.items():
            if key.startswith(f"synth.out.{name}_first"):
                rows = int(key.rpartition("_first")[2])
                found[key] = (
                    apart(matrix[:rows, :rows], expected),
                    1e-3 if name == "coords_dist" else FEATURES,
                )
    of_circle = torch.autograd.grad(losses.circle, sides, retain_graph=True)
    found |= {
        f"synth.out.grad_circle_{side}_feats": (
            apart(value, want[f"synth.out.grad_circle_{side}_feats"]),
            LOSS,
        )
        for side, value in zip(("src", "ref"), of_circle, strict=True)
    }
    for name, part, score in (
        ("overlap", losses.overlap, scores[0]),
        ("saliency", losses.saliency, scores[1]),
    ):
        key = f"synth.out.grad_{name}_scores"
        found[key] = (apart(torch.autograd.grad(part.loss, score, retain_graph=True)[0], want[key]), LOSS)
    return found
