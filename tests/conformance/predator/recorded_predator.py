# SPDX-License-Identifier: MIT
"""Predator against its recording: every block, the scores, the losses on them and alone, and gradients."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from arrays import Found, apart, complete, held, read_arrays, read_plan, read_weights
from predator_training import losses_alone, losses_on_recording, training
from stacked import (
    FEATURES,
    EncoderOutputs,
    backbone_config,
    decoder_outputs,
    read_batch,
    recorded_order,
)
from torch import Tensor

from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.predator.config import GraphConfig, PredatorConfig, PredatorLossConfig
from hybridreg.learned.predator.graph import nearest_others
from hybridreg.learned.predator.network import PredatorNetwork
from hybridreg.learned.predator.official_names import official_name
from hybridreg.learned.weights import load_official_tensors

# Metres: the expanded square's rounding at the clouds' distance from the origin.
_KNN_TIE = 1e-3


def compare(stem: Path) -> Found:
    """Largest difference and tolerance by recorded output."""
    plan = read_plan(stem)
    want = read_arrays(stem.with_name(f"{stem.name}.npz"))
    config = network_config(plan)
    network = PredatorNetwork(config)
    load_official_tensors(network, read_weights(stem), stem.name, official_name)
    batch = read_batch(want, config.backbone.stages)
    with torch.no_grad():
        found = held(block_outputs(network.eval(), batch), want, "out.", FEATURES) | _neighbors(
            batch, config, want
        )
        found |= losses_on_recording(network, batch, want, "loss.")
    found |= training(network, batch, want, plan)
    found |= losses_alone(want, config.loss)
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
