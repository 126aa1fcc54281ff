# SPDX-License-Identifier: MIT
"""CoFiNet against its recording: every block, both transports, matches, truth, losses, and gradients."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from arrays import Found, apart, complete, held, read_arrays, read_plan, read_weights
from cofinet_alone import losses_alone, transports
from cofinet_matching import assignments_apart, matching, named_steps
from cofinet_training import recorded_targets, training
from stacked import (
    FEATURES,
    EncoderOutputs,
    backbone_config,
    decoder_outputs,
    read_batch,
    recorded_order,
)
from torch import Tensor

from hybridreg.learned.cofinet.config import CofinetConfig, CofinetLossConfig, SelectionConfig
from hybridreg.learned.cofinet.network import CofinetEncoding, CofinetNetwork
from hybridreg.learned.cofinet.official_names import UNUSED, official_name
from hybridreg.learned.cofinet.transformer import scores
from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.weights import load_official_tensors

COARSE = 1e-3


def compare(stem: Path) -> Found:
    """Largest difference and tolerance by recorded output."""
    plan = read_plan(stem)
    want = read_arrays(stem.with_name(f"{stem.name}.npz"))
    config = network_config(plan)
    network = CofinetNetwork(config)
    load_official_tensors(network, read_weights(stem), stem.name, official_name, UNUSED)
    batch = read_batch(want, config.backbone.stages)
    with torch.no_grad():
        encoding, found = _forward(network.eval(), batch, want)
        found |= matching(network, encoding, want)
        targets, about_targets = recorded_targets(batch, config, want)
        found |= about_targets
        fine = network.assign_points(encoding, targets.patches)
        found["loss.fine_log_assignment"] = assignments_apart(fine, want["loss.fine_log_assignment"])
        key = "loss.coarse_log_assignment"
        found[key] = (apart(encoding.log_assignment, want[key]), COARSE)
    found |= training(network, batch, targets, want, plan)
    found |= transports(config, want) | losses_alone(config, want)
    inputs = ("in.", "ot.coarse.in", "ot.coarse.bin_score", "ot.fine.in", "ot.fine.node_conf")
    return complete(found, want, [*inputs, *(name for name in want if name.startswith("synth.gt_"))])


def network_config(plan: Mapping[str, Any]) -> CofinetConfig:
    """Our configuration of a recorded plan."""
    coarse, fine, train = plan["coarse"], plan["fine"], plan["train"]
    selection = plan["coarse_selection"]
    if coarse.get("position_embedding") or fine.get("padding_masked_in_attention"):
        raise ValueError(
            "CoFiNet as released has no position embedding and masks no padding in its attention"
        )
    wanted = ["self", "cross", "self"]
    if coarse["blocks"] != wanted or fine["blocks"] != wanted:
        raise ValueError(
            f"blocks {coarse['blocks']} and {fine['blocks']}: the released weights have {wanted}"
        )
    config = CofinetConfig(
        backbone=backbone_config(plan),
        dim=coarse["dim"],
        heads=coarse["heads"],
        fine_heads=fine["heads"],
        sinkhorn_iterations=plan["sinkhorn_iterations"],
        sinkhorn_form="log",
        patch_points=plan["points_in_patch"]["eval"],
        patch_rule="first",
        padding="point0",
        selection=SelectionConfig(
            threshold=selection["initial_threshold"],
            step=selection["decay"],
            min_pairs=selection["min_correspondences"],
            max_pairs=None,
        ),
        loss=CofinetLossConfig(
            pairs=train["coarse_pairs_drawn"],
            patch_points=plan["points_in_patch"]["train"],
            min_overlap=train["patch_overlap_threshold"],
            overlap_radius=train["overlap_radius"],
            fine_radius=train["fine_positive_radius"],
            coarse_weight=plan["loss"]["w_coarse"],
            fine_weight=plan["loss"]["w_fine"],
        ),
    )
    if fine["dim"] != config.fine_dim:
        raise ValueError(f"the plan says a fine dim of {fine['dim']}, its coarse dim gives {config.fine_dim}")
    return config


def _forward(
    network: CofinetNetwork, batch: Batch, want: Mapping[str, Tensor]
) -> tuple[CofinetEncoding, Found]:
    pyramid, last = batch.pyramid, batch.pyramid.stages - 1
    with EncoderOutputs(network.encoder, pyramid) as seen:
        features, skips = network.encoder(batch.features, pyramid)
    before = network.bottleneck(features)
    seen["bottle"] = recorded_order(before, pyramid, last)
    target, source = before.split(list(pyramid.lengths[-1]))
    seen |= named_steps("coarse", (source, target), list(network.coarse.steps((source, target))))
    projected = seen["coarse.proj.src"], seen["coarse.proj.ref"]
    seen |= decoder_outputs(network.decoder, torch.cat([projected[1], projected[0]]), skips, pyramid)
    encoding = network.encode(batch)
    seen["feats"] = torch.cat([encoding.source.point_features, encoding.target.point_features])
    found = held(seen, want, "out.", FEATURES)
    found["out.coarse_scores"] = (apart(scores(projected), want["out.coarse_scores"]), COARSE)
    found["out.coarse_log_assignment"] = (
        apart(encoding.log_assignment, want["out.coarse_log_assignment"]),
        COARSE,
    )
    return encoding, found
