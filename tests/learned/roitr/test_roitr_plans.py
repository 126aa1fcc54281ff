# SPDX-License-Identifier: MIT
"""The comparison takes any plan: recordings of our own network with other plans pass, end to end.

This says nothing about the original (test_roitr_conformance.py does): it shows that widths, strides, neighbours, blocks
and heads come from the JSON.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from bushes import bush

from hybridreg.learned.cross3dreg.network import CloudEncoding
from hybridreg.learned.geotransformer.structure_embedding import neighbor_angles
from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.matching.procrustes import weighted_procrustes
from hybridreg.learned.roitr.encoder_decoder import LevelFeatures
from hybridreg.learned.roitr.losses import right_shares, validation_losses
from hybridreg.learned.roitr.network import RoitrNetwork
from hybridreg.learned.roitr.official_names import official_name, unused_names
from hybridreg.learned.roitr.point_levels import Levels
from hybridreg.learned.roitr.superpoint_pairs import match_adaptively
from hybridreg.learned.roitr.targets import compute_targets, visible_shares

Values = dict[str, torch.Tensor]
MARGINS = {"positive_margin": 0.1, "negative_margin": 1.4, "positive_optimal": 0.1, "negative_optimal": 1.4}


def plan(
    widths: list[int], strides: list[int], neighbors: list[int], blocks: list[int], heads: int
) -> dict[str, Any]:
    """A recorded configuration as the original's recordings have it."""
    dim = widths[-1]
    return {
        "normals": {"knn": 12},
        "widths": widths,
        "local_hidden": [min(width, 12) for width in widths],
        "heads": heads,
        "decoder_heads": heads,
        "blocks_per_level": blocks,
        "strides": strides,
        "neighbors": neighbors,
        "neighbors_exclude_self": True,
        "interpolation_neighbors": 2,
        "transformer": {
            "blocks": ["self", "self", "cross"],
            "width": dim,
            "heads": heads,
            "sigma_d": 1.5,
            "sigma_a": 20,
            "angle_k": 2,
        },
        "coarse_dim": dim,
        "fine_dim": 20,
        "coarse_matching": {"kind": "dual-normalised top-k", "superpoint_correspondences": 12},
        "adaptive_matching": {"minimum": 9, "similarity_threshold": 0.3},
        "matching_radius": 0.4,
        "points_in_patch": 11,
        "sinkhorn_iterations": 30,
        "fine": {
            "topk": 2,
            "mutual": True,
            "confidence_threshold": 0.02,
            "use_dustbin": False,
            "use_global_score": False,
        },
        "coarse_loss": {**MARGINS, "log_scale": 16, "positive_overlap": 0.1, "weight": 1.0},
        "fine_loss": {"positive_radius": 0.3, "weight": 0.5},
        "training": {"gt_correspondences": 8, "overlap_threshold": 0.1},
        "evaluation": {"acceptance_overlap": 0.0, "acceptance_radius": 0.5},
        "occlusion_radius": 0.05,
    }


def record(stem: Path, description: dict[str, Any]) -> None:
    """Write a recording of our own network."""
    from roitr_plan import network_config

    config = network_config(description)
    network = RoitrNetwork(config).eval()
    batch, truth = bush(3, config, n=220)
    values: Values = {"in.transform": truth}
    with torch.no_grad():
        for side, levels in (("src", batch.source), ("tgt", batch.target)):
            values |= _inputs(side, levels) | _backbone(network, side, levels)
        values |= _transformer(network, values)
        values |= _matching(network, batch, truth, description)
    values |= _training(network, batch, truth)
    np.savez(stem.with_name(f"{stem.name}.npz"), **{name: value.numpy() for name, value in values.items()})
    weights = {f"w.{official_name(name)}": tensor.numpy() for name, tensor in network.state_dict().items()}
    weights |= {f"w.{name}": np.zeros(1, np.float32) for name in unused_names(network.state_dict())}
    np.savez(stem.with_name(f"{stem.name}_weights.npz"), **weights)
    stem.with_name(f"{stem.name}.json").write_text(json.dumps(description))


def _inputs(side: str, levels: Levels) -> Values:
    values = {f"in.{side}_points": levels.points[0], f"in.{side}_normals": levels.normals[0]}
    for level, rows in enumerate(levels.neighbors, start=1):
        values[f"in.{side}.knn.{level}"] = rows.int()
        if level > 1:
            values[f"in.{side}.fps.{level}"] = levels.picked[level - 2].int()
            values[f"in.{side}.down_knn.{level}"] = levels.down[level - 2].int()
        if level < len(levels.points):
            values[f"in.{side}.up_knn.{level}"] = levels.up[level - 1].int()
            values[f"in.{side}.up_dist.{level}"] = levels.up_distance[level - 1]
    return values


def _backbone(network: RoitrNetwork, side: str, levels: Levels) -> Values:
    backbone, ppf = network.backbone, LevelFeatures.of(levels)
    encoded = backbone.encode(levels, ppf)
    values, features = {}, None
    for level in range(len(encoded)):
        finer = encoded[level - 1] if level else torch.ones(len(levels.points[0]), 1)
        values[f"out.{side}.enc_down.{level + 1}"] = backbone.abstract(level, finer, levels, ppf)
        values[f"out.{side}.enc.{level + 1}"] = encoded[level]
        values[f"out.{side}.ppf.{level + 1}"] = ppf.within[level][:30]
        if level:
            values[f"out.{side}.points.{level + 1}"] = levels.points[level]
            values[f"out.{side}.down_ppf.{level + 1}"] = ppf.down[level - 1][:30]
    for level in reversed(range(len(encoded))):
        features = backbone.step_up(level, encoded[level], features, levels)
        values[f"out.{side}.dec_up.{level + 1}"] = features
        features = backbone.decoder[level].block(features, levels.neighbors[level], ppf.within[level])
        values[f"out.{side}.dec.{level + 1}"] = features
    assert features is not None
    values[f"out.{side}_point_feats_first50"] = network.fine_proj(features)[:50]
    return values


def _transformer(network: RoitrNetwork, values: Values) -> Values:
    from recorded_roitr import _cross_weights, _self_weights

    transformer, found = network.transformer, {}
    last = network.config.levels
    points = {}
    for side in ("src", "tgt"):
        points[side] = values[f"out.{side}.points.{last}"]
        distance = squared_distances(points[side], points[side]).sqrt()
        found[f"out.{side}.global.distance_indices"] = distance / transformer.embedding.sigma_d
        nearest = distance.topk(transformer.embedding.angle_k + 1, largest=False)[1][:5, 1:]
        angles = neighbor_angles(points[side][:5], points[side], points[side][nearest])
        found[f"out.{side}.global.angle_indices_first5"] = angles * transformer.embedding.angle_scale
        found[f"out.{side}.global.embedding_first9"] = transformer.embedding(points[side])[:9, :9]
    features = {side: transformer.in_proj(values[f"out.{side}.enc.{last}"]) for side in points}
    structures = {side: transformer.embedding(points[side]) for side in points}
    positions: Values = {}
    for index, (kind, layer) in enumerate(zip(transformer.kinds, transformer.layers, strict=True)):
        for side, other in (("src", "tgt"), ("tgt", "src")):
            if kind == "self":
                weights = _self_weights(layer.attention, features[side], structures[side])
                features[side], positions[side] = layer(features[side], structures[side])
                found[f"out.{side}.global.position.{index}"] = positions[side]
            else:
                memory = features[other] + positions[other]
                weights = _cross_weights(layer.attention, features[side] + positions[side], memory)
                features[side] = layer(features[side], positions[side], features[other], positions[other])
            found[f"out.{side}.global.feats.{index}"] = features[side]
            found[f"out.{side}.global.attention_first4.{index}"] = weights[:, :4]
    return found


def _matching(network: RoitrNetwork, batch: Any, truth: torch.Tensor, description: dict[str, Any]) -> Values:
    output, config = network(batch), network.config
    clouds: dict[str, CloudEncoding] = {"tgt": output.target, "src": output.source}
    values: Values = {}
    for side, cloud in clouds.items():
        values |= {
            f"out.{side}_node_feats": cloud.node_features,
            f"out.{side}_nodes": cloud.nodes,
            f"out.{side}.point_to_node": cloud.patches.owner,
            f"out.{side}.node_masks": cloud.patches.occupied,
            f"out.{side}.node_knn_indices": cloud.patches.index,
            f"out.{side}.node_knn_masks": cloud.patches.mask,
        }
    targets = compute_targets(batch, truth, config)
    shares = visible_shares(
        (output.target.points, output.source.points),
        (output.target.patches, output.source.patches),
        truth,
        config.occlusion_radius,
    )
    adaptive = description["adaptive_matching"]
    near = match_adaptively(
        output.target.node_features,
        output.source.node_features,
        adaptive["minimum"],
        adaptive["similarity_threshold"],
    )
    pairs = network.pair_up(
        output.target, output.source, output.superpoints.target, output.superpoints.source
    )
    first = pairs.take(torch.arange(3))
    losses = validation_losses(network, output, targets)
    matches = output.matches
    evaluation = description["evaluation"]
    pir, ir = right_shares(output, targets, evaluation["acceptance_radius"], evaluation["acceptance_overlap"])
    return values | {
        "out.gt_node_corr_indices": torch.stack([targets.target, targets.source], 1),
        "out.gt_node_corr_overlaps": targets.overlap,
        "out.gt_tgt_node_occ": shares[0],
        "out.gt_src_node_occ": shares[1],
        "out.tgt_node_corr_indices": output.superpoints.target,
        "out.src_node_corr_indices": output.superpoints.source,
        "out.node_corr_scores": output.superpoints.score,
        "adaptive.out.tgt_indices": near.target,
        "adaptive.out.src_indices": near.source,
        "adaptive.out.scores": near.score,
        "out.ot_input_first3": network.scores(output.target, output.source, first),
        "out.ot_row_masks_first3": first.target_mask,
        "out.ot_col_masks_first3": first.source_mask,
        "out.matching_scores_first3": network.assign(output.target, output.source, first),
        "out.tgt_corr_points": matches.target,
        "out.src_corr_points": matches.source,
        "out.corr_scores": matches.weight,
        "out.procrustes_transform": weighted_procrustes(matches.source, matches.target, matches.weight),
        "out.loss_coarse": losses.coarse,
        "out.loss_fine": losses.fine,
        "out.loss": losses.total,
        "out.PIR": torch.tensor(pir),
        "out.IR": torch.tensor(ir),
    }


def _training(network: RoitrNetwork, batch: Any, truth: torch.Tensor) -> Values:
    targets = compute_targets(batch, truth, network.config, torch.Generator().manual_seed(0))
    clouds = network.encode(batch)
    losses = network.losses(clouds, targets)
    losses.total.backward()
    nodes = targets.target[targets.drawn], targets.source[targets.drawn]
    pairs = network.pair_up(*clouds, *nodes).take(torch.arange(2))
    names = ("fine_proj.weight", "backbone.encoder.0.abstraction.code.weight", "transport.alpha")
    gradients = {name: parameter.grad for name, parameter in network.named_parameters()}
    values = {f"train.grad.{official_name(name)}": gradients[name] for name in names}
    return values | {
        "train.in.tgt_node_corr_indices": nodes[0],
        "train.in.src_node_corr_indices": nodes[1],
        "train.in.node_corr_overlaps": targets.overlap[targets.drawn],
        "train.out.matching_scores_first2": network.assign(*clouds, pairs).detach(),
        "train.out.loss_coarse": losses.coarse.detach(),
        "train.out.loss_fine": losses.fine.detach(),
        "train.out.loss": losses.total.detach(),
    }


@pytest.mark.parametrize(
    "description",
    [
        plan([8, 12, 16, 24], [1, 2, 2, 2], [5, 6, 7, 4], [2, 2, 1, 3], 2),
        plan([6, 12], [1, 5], [4, 9], [1, 2], 3),
        plan([8, 8, 16], [1, 1, 4], [3, 5, 6], [3, 1, 2], 4),
    ],
    ids=["four levels", "two levels", "a stride of one"],
)
def test_other_plans(tmp_path: Path, description: dict[str, Any]) -> None:
    from run import main

    torch.manual_seed(0)
    record(tmp_path / "made", description)
    assert main([str(tmp_path / "made")]) == 0
    values = dict(np.load(tmp_path / "made.npz"))
    for name in ("out.src.dec.1", "out.loss_fine", "train.grad.fine_proj.weight"):
        spoiled = values[name] + np.float32(0.02 * max(1.0, np.abs(values[name]).max()))
        np.savez(tmp_path / "made.npz", **{**values, name: spoiled})
        assert main([str(tmp_path / "made")]) == 1, name
    rows = values["in.tgt.knn.2"][:, ::-1]
    np.savez(tmp_path / "made.npz", **{**values, "in.tgt.knn.2": np.ascontiguousarray(rows)})
    assert main([str(tmp_path / "made")]) == 1
