# SPDX-License-Identifier: MIT
"""CoFiNet's recording: truth, losses and gradients."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import torch
from arrays import Found, apart
from cofinet_matching import patches_apart, recorded_patches, tied_matches
from stacked import TIE, gradients_apart, norms_apart
from torch import Tensor

from hybridreg.learned.cofinet.config import CofinetConfig
from hybridreg.learned.cofinet.network import CofinetNetwork
from hybridreg.learned.cofinet.official_names import official_name
from hybridreg.learned.cofinet.patching import PatchIndex
from hybridreg.learned.cofinet.targets import (
    CofinetTargets,
    node_weights,
    training_patches,
    true_pairs,
    with_pairs,
)
from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.matching.procrustes import apply_transform

LOSS = 1e-4
# Probabilities and weights this near to a threshold fall on either side of it.
THRESHOLD_TIE = 1e-4
_WEIGHT_TIE = 1e-6
# Share of the true pairs of points that may be forgiven because they lie at the radius.
_FORGIVEN = 0.01


def recorded_targets(
    batch: Batch, config: CofinetConfig, want: Mapping[str, Tensor]
) -> tuple[CofinetTargets, Found]:
    """Targets of the recorded draw. The truth that goes on is the recorded one where ours differs by a tie alone."""
    pyramid = batch.pyramid
    target, source = pyramid.clouds(0)
    nodes = pyramid.clouds(pyramid.stages - 1)
    pairs = want["in.correspondences"].long()
    owners = (want["out.point_to_node.src"].long(), want["out.point_to_node.ref"].long())
    shared = ((pairs[:, 0], pairs[:, 1]), owners, (len(nodes[1]), len(nodes[0])))
    coarse, unfiltered = node_weights(*shared, config.loss.min_overlap), node_weights(*shared, 0.0)
    expected = want["loss.gt_matching_mask"]
    tied = (unfiltered - config.loss.min_overlap).abs() < _WEIGHT_TIE
    coarse = torch.where(tied, expected, coarse)
    drawn = want["loss.drawn_node_corr"].long()
    patches = training_patches(pyramid, config)
    moved = apply_transform(source, want["in.transform"])
    targets = with_pairs(coarse, drawn, recorded_patches(want, "loss.patch."), (moved, target), config)
    fine, recorded = targets.fine, want["loss.gt_fine"]
    at_radius = _at_radius(targets.patches, (moved, target), config.loss.fine_radius)
    fine = torch.where(at_radius, recorded, fine)
    known = {tuple(pair) for pair in want["loss.gt_node_corr"].tolist()}
    ours = {tuple(pair) for pair in true_pairs(coarse).tolist()}
    found: Found = {
        "loss.gt_matching_mask": (apart(coarse, expected), 1e-5),
        "loss.gt_node_corr": (float(len(ours ^ known)), 0.0),
        "loss.drawn_node_corr": (
            float(len({tuple(pair) for pair in drawn.tolist()} - ours) + abs(len(drawn) - config.loss.pairs)),
            0.0,
        ),
        "loss.gt_fine": (apart(fine, recorded), 0.0),
        "loss.gt_fine, points at the radius": (
            float((at_radius & (targets.fine != recorded)).sum()),
            _FORGIVEN * float(recorded.sum()),
        ),
    }
    for name, side, cloud, at in (("src", 0, source, nodes[1]), ("ref", 1, target, nodes[0])):
        found[f"loss.patch.{name}"] = patches_apart(patches[side], cloud, at, want[f"loss.patch.{name}"])
    same = CofinetTargets(coarse=coarse, drawn=drawn, patches=targets.patches, fine=fine)
    return same, found


def _at_radius(
    patches: tuple[PatchIndex, PatchIndex], points: tuple[Tensor, Tensor], radius: float
) -> Tensor:
    """(B, P + 1, P + 1): pairs within 1e-5 m of the radius, and the slack of both their points."""
    source, target = points[0][patches[0].filled], points[1][patches[1].filled]
    distance = torch.cdist(source, target, compute_mode="donot_use_mm_for_euclid_dist")
    tied = (distance - radius).abs() < TIE
    padded = torch.nn.functional.pad(tied, (0, 1, 0, 1))
    padded[:, :-1, -1], padded[:, -1, :-1] = tied.any(2), tied.any(1)
    return padded


def training(
    network: CofinetNetwork,
    batch: Batch,
    targets: CofinetTargets,
    want: Mapping[str, Tensor],
    plan: Mapping[str, Any],
) -> Found:
    """Losses, measures and gradients of a training step."""
    names = {name: official_name(name) for name in network.state_dict()}
    network.train().zero_grad(set_to_none=True)
    losses = network.losses(network.encode(batch), targets)
    losses.total.backward()  # type: ignore[no-untyped-call]
    found: Found = {}
    loose = _loose(network, batch, targets)
    for prefix in ("loss.out.", "train.out."):
        for name, value in named_parts(losses).items():
            found[f"{prefix}{name}"] = (apart(value, want[f"{prefix}{name}"]), LOSS + loose.get(name, 0.0))
    found |= gradients_apart(network, names, want, "train.")
    found["train.grad_norm"] = norms_apart(
        network, names, plan["train_grad_norm_names"], want["train.grad_norm"]
    )
    network.eval().zero_grad(set_to_none=True)
    return found


@torch.no_grad()
def _loose(network: CofinetNetwork, batch: Batch, targets: CofinetTargets) -> dict[str, float]:
    """By how much the two measures may be off because of ties: both count."""
    encoding = network.encode(batch)
    found = ((encoding.log_assignment.exp() - 0.1).abs() < THRESHOLD_TIE) & (targets.coarse > 0)
    tied = tied_matches(network, encoding, targets.patches).flatten(1).any(1)
    return {
        "matching_recall": float(found.sum() / targets.coarse.sum().clamp_min(1e-9)),
        "local_matching_precision": float(tied.float().mean()),
    }


def named_parts(losses: Any) -> dict[str, Tensor]:
    """Losses and measures by the recording's names."""
    return {
        "matching_loss": losses.coarse,
        "local_matching_loss": losses.fine,
        "total_loss": losses.total,
        "matching_recall": losses.coarse_recall,
        "local_matching_precision": losses.fine_precision,
    }
