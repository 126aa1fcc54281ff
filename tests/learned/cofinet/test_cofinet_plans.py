# SPDX-License-Identifier: MIT
"""The recorded CoFiNet agrees, and the runner takes any plan: recordings of our own network with others pass."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from stacked_recordings import backbone_plan, gradients, inputs, made_batch, true_points, unsettle, write
from torch import Tensor

from hybridreg.learned.cofinet.network import CofinetNetwork
from hybridreg.learned.cofinet.official_names import official_name
from hybridreg.learned.cofinet.point_transport import MASKED
from hybridreg.learned.cofinet.selection import select
from hybridreg.learned.cofinet.targets import compute_targets, training_patches, true_pairs
from hybridreg.learned.cofinet.transformer import scores
from hybridreg.learned.pyramid.neighbors import pairs_within
from hybridreg.learned.pyramid.patches import build_patches

BLOCKS = ["self", "cross", "self"]


def plan(
    backbone: dict[str, Any], dim: int, heads: int, patch: tuple[int, int], **selection: Any
) -> dict[str, Any]:
    """A recorded configuration as the original's recordings have it."""
    fine = dim >> (backbone["stages"] - 1)
    voxel = backbone["voxel"]
    return {
        **backbone,
        "final_dim": fine,
        "coarse": {"dim": dim, "heads": heads, "blocks": BLOCKS, "position_embedding": False},
        "fine": {"dim": fine, "heads": heads, "blocks": BLOCKS, "padding_masked_in_attention": False},
        "sinkhorn_iterations": 12,
        "points_in_patch": {"eval": patch[0], "train": patch[1]},
        "coarse_selection": {
            "initial_threshold": 0.15,
            "decay": 0.02,
            "min_correspondences": 20,
            "compare": "strictly greater",
            **selection,
        },
        "train": {
            "coarse_pairs_drawn": 9,
            "with_replacement": True,
            "patch_overlap_threshold": 0.1,
            "overlap_radius": 1.4 * voxel,
            "fine_positive_radius": 1.6 * voxel,
        },
        "loss": {"w_coarse": 0.7, "w_fine": 1.3},
    }


PLANS = {
    "three stages": plan(
        backbone_plan(
            ["simple", "resnetb_strided", "resnetb", "resnetb_strided"]
            + ["nearest_upsample", "unary", "nearest_upsample", "last_unary"],
            8,
            7,
            0.6,
        ),
        24,
        3,
        (10, 18),
    ),
    "two stages, every pair": plan(
        backbone_plan(
            ["simple", "resnetb", "resnetb_strided", "nearest_upsample", "last_unary"], 12, 15, 1.5
        ),
        16,
        2,
        (6, 5),
        min_correspondences=100_000,
        initial_threshold=0.06,
    ),
}


def record(stem: Path, description: dict[str, Any]) -> None:
    """Write a recording of our own network."""
    from recorded_cofinet import network_config

    torch.manual_seed(0)
    config = network_config(description)
    network = CofinetNetwork(config)
    unsettle(network)
    batch = made_batch(config, *((1500, 12.0) if config.backbone.stages > 2 else (300, 6.0)))
    moved, target = true_points(batch)
    values = inputs(batch.pyramid, pairs_within(moved, target, config.loss.overlap_radius))
    targets = compute_targets(batch.pyramid, values["in.transform"], config, torch.Generator().manual_seed(0))
    with torch.no_grad():
        values |= _forward(network, batch)
    values |= {"loss.gt_matching_mask": targets.coarse, "loss.gt_node_corr": true_pairs(targets.coarse)}
    values |= {"loss.drawn_node_corr": targets.drawn, "loss.gt_fine": targets.fine}
    for name, each in zip(("src", "ref"), training_patches(batch.pyramid, config), strict=True):
        values[f"loss.patch.{name}"] = each.index.masked_fill(~each.mask, -1)
    encoding = network.train().encode(batch)
    losses = network.losses(encoding, targets)
    losses.total.backward()
    values["loss.coarse_log_assignment"] = encoding.log_assignment
    values["loss.fine_log_assignment"] = network.assign_points(encoding, targets.patches)
    for prefix in ("loss.out.", "train.out."):
        values |= {f"{prefix}matching_loss": losses.coarse, f"{prefix}local_matching_loss": losses.fine}
        values |= {f"{prefix}total_loss": losses.total, f"{prefix}matching_recall": losses.coarse_recall}
        values[f"{prefix}local_matching_precision"] = losses.fine_precision
    names = ["l_bin_score", *[official_name(name) for name, _ in network.named_parameters()]]
    values |= gradients(network, official_name, names, "train.")
    weights = {official_name(name): tensor for name, tensor in network.state_dict().items()}
    weights |= {"l_bin_score": torch.tensor(1.3), "encoder.epsilon": torch.tensor(-2.0)}
    write(stem, {**description, "train_grad_norm_names": names}, values, weights)


def _forward(network: CofinetNetwork, batch: Any) -> dict[str, Tensor]:
    config, encoding = network.eval().config, network.encode(batch)
    clouds = {"src": encoding.source, "ref": encoding.target}
    nodes, tried = select(encoding.log_assignment[:-1, :-1].exp(), config.selection)
    patches = network.patches(encoding)
    sides = (patches[0].take(nodes.source), patches[1].take(nodes.target))
    found = network.match_points(encoding, nodes)
    values = {
        "out.feats": torch.cat([cloud.point_features for cloud in clouds.values()]),
        "out.coarse_scores": scores((encoding.source.node_features, encoding.target.node_features)),
        "out.coarse_log_assignment": encoding.log_assignment,
        "out.coarse_thresholds": torch.tensor([each.threshold for each in tried], dtype=torch.float64),
        "out.coarse_counts": torch.tensor([each.pairs for each in tried]),
        "out.node_corr": torch.stack([nodes.source, nodes.target], 1),
        "out.node_corr_conf": nodes.confidence,
        "out.correspondence_conf": found.weight,
        "out.src_corr_points": found.source,
        "out.ref_corr_points": found.target,
        "out.src_corr_indices": found.source_index,
        "out.ref_corr_indices": found.target_index,
        "out.sample_prob": found.weight / found.weight.sum(),
        "out.fine_log_assignment_first3": network.assign_points(encoding, sides)[:3],
    }
    blocks, masks = network.fine_input(encoding, sides)
    projected = network.fine(blocks, masks)
    valid = sides[0].mask[:, :, None] & sides[1].mask[:, None]
    values["out.fine_scores_first3"] = scores(projected).masked_fill(~valid, MASKED)[:3]
    slots = []
    for i, (name, cloud) in enumerate(clouds.items()):
        values[f"out.coarse.proj.{name}"] = cloud.node_features
        values[f"out.fine_first3.before.{name}"] = blocks[i][:3]
        values[f"out.fine_first3.proj.{name}"] = projected[i][:3]
        values[f"out.point_to_node.{name}"] = build_patches(cloud.points, cloud.nodes, 1).owner
        values[f"out.patch.{name}"] = patches[i].index.masked_fill(~patches[i].mask, -1)
        index = (found.source_index, found.target_index)[i]
        rows = sides[i].index[found.group]
        slots.append((rows == index[:, None]).int().argmax(1) + found.group * config.patch_points)
    values["out.correspondences"] = torch.stack(slots, 1)
    return values


@pytest.mark.parametrize("name", PLANS)
def test_other_plans(tmp_path: Path, name: str) -> None:
    from run import main

    record(tmp_path / "made", PLANS[name])
    assert main([str(tmp_path / "made")]) == 0
    with np.load(tmp_path / "made.npz") as arrays:
        values = dict(arrays)
    worst = np.unravel_index(
        values["out.coarse_log_assignment"][:-1, :-1].argmin(), values["out.coarse_scores"].shape
    )
    spoiled = {
        "loss.out.matching_loss": values["loss.out.matching_loss"] + np.float32(1e-3),
        "out.node_corr": np.vstack([values["out.node_corr"][:-1], worst]),
        "out.something": values["out.feats"],
    }
    for key, value in spoiled.items():
        np.savez(tmp_path / "made.npz", **{**values, key: value})
        assert main([str(tmp_path / "made")]) == 1, key


def test_the_recording_agrees(recording_stem: Path) -> None:
    from run import main

    assert main([str(recording_stem.with_name("cofinet_kitti_mini"))]) == 0


@pytest.fixture(scope="module")
def small_recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of our own network as it is."""
    stem: Path = tmp_path_factory.mktemp("small") / "made"
    record(stem, PLANS["three stages"])
    return stem


@pytest.mark.parametrize("change", ["padding", "transport", "patches"])
def test_what_one_would_guess_wrong_is_noticed(
    small_recording: Path, change: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    import dataclasses

    import recorded_cofinet

    from hybridreg.learned.cofinet import network
    from hybridreg.learned.matching.sinkhorn import log_sinkhorn

    built = recorded_cofinet.network_config
    if change == "transport":

        def learned_slack(similarity: Tensor, iterations: int) -> Tensor:
            rows = torch.ones(similarity.shape[:2], dtype=torch.bool)
            columns = torch.ones(similarity.shape[0], similarity.shape[2], dtype=torch.bool)
            return log_sinkhorn(similarity, rows, columns, torch.tensor(0.0), iterations)

        monkeypatch.setattr(network, "alternating_sinkhorn", learned_slack)
    else:
        other = {"padding": {"padding": "masked"}, "patches": {"patch_rule": "nearest"}}[change]
        monkeypatch.setattr(
            recorded_cofinet, "network_config", lambda plan: dataclasses.replace(built(plan), **other)
        )
    found = recorded_cofinet.compare(small_recording)
    assert any(not value <= tolerance for value, tolerance in found.values())
