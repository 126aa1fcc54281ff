# SPDX-License-Identifier: MIT
"""The conformance runner takes any plan: recordings of our own network with other plans pass, end to end.

This says nothing about the original (test_conformance.py does): it shows that stages, widths, limits,
groups and blocks come from the JSON.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from streets import moved, street, yaw

from hybridreg.learned.cross3dreg.batch import make_batch
from hybridreg.learned.cross3dreg.losses import overlap_matrix
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.targets import compute_targets
from hybridreg.learned.geotransformer.official_names import official_name
from hybridreg.learned.losses.circle_loss import circle_loss
from hybridreg.learned.losses.fine_loss import assignment_loss
from hybridreg.learned.matching.local_to_global import local_to_global
from hybridreg.learned.matching.procrustes import apply_transform

MARGINS = {"positive_margin": 0.1, "negative_margin": 1.4, "positive_optimal": 0.1, "negative_optimal": 1.4}


def plan(stages: int, width: int, groups: int, blocks: list[str]) -> dict:  # type: ignore[type-arg]
    """A recorded configuration as the original's recordings have it."""
    return {
        "stages": stages,
        "voxel": 0.6,
        "base_radius": 2.5,
        "base_sigma": 2.0,
        "neighbor_limits": [9 + stage for stage in range(stages)],
        "init_dim": width,
        "group_norm": groups,
        "fine_dim": 24,
        "transformer": {
            "input_dim": width * 2**stages,
            "hidden_dim": 24,
            "output_dim": 20,
            "heads": 2,
            "blocks": blocks,
            "sigma_d": 3.0,
            "sigma_a": 10,
            "angle_k": 2,
        },
        "matching_radius": 0.9,
        "points_in_patch": 20,
        "sinkhorn_iterations": 15,
        "superpoint_correspondences": 10,
        "fine": {
            "topk": 3,
            "acceptance_radius": 0.9,
            "mutual": True,
            "confidence_threshold": 0.02,
            "correspondence_threshold": 3,
            "refinement_steps": 4,
        },
        "coarse_loss": {**MARGINS, "log_scale": 24, "positive_overlap": 0.1},
        "fine_loss": {"positive_radius": 0.9},
    }


@torch.no_grad()
def record(stem: Path, description: dict) -> None:  # type: ignore[type-arg]
    """Write a recording of our own network."""
    from plan import network_config

    config = network_config(description)
    network = RegistrationNetwork(config).eval()
    truth = yaw(40.0, (1.0, 0.0, 0.0))
    target, source = street(1, 1500, 12.0), moved(street(2, 1500, 12.0), np.linalg.inv(truth))
    batch = make_batch(target, source, config)
    pyramid, output = batch.pyramid, network(batch)
    values: dict[str, torch.Tensor] = {"in.transform": torch.from_numpy(truth).float()}
    for stage in range(config.backbone.stages):
        values |= {
            f"in.points.{stage}": pyramid.points[stage],
            f"in.lengths.{stage}": torch.tensor(pyramid.lengths[stage]),
            f"in.neighbors.{stage}": pyramid.neighbors[stage].int(),
        }
        if stage + 1 < config.backbone.stages:
            values[f"in.subsampling.{stage}"] = pyramid.subsampling[stage].int()
            values[f"in.upsampling.{stage}"] = pyramid.upsampling[stage][:, None].int()
    coarse, fine = network.backbone(batch.features, pyramid)
    values |= {"out.feats_coarse": coarse, "out.feats_fine": fine, **_encoder_outputs(network, batch)}
    assert network.transformer.embedding is not None
    embedding = network.transformer.embedding(output.encoding.source.nodes)
    values["out.src_geo_embedding_first32"] = embedding[:32, :32]
    values["out.ref_feats_c"], values["out.src_feats_c"] = output.node_features
    nodes = output.superpoints
    values["out.ref_node_corr_indices"], values["out.src_node_corr_indices"] = nodes.target, nodes.source
    values |= _matching(network, output, values["in.transform"], pyramid)
    np.savez(stem.with_name(f"{stem.name}.npz"), **{name: value.numpy() for name, value in values.items()})
    weights = {f"w.{official_name(name)}": tensor.numpy() for name, tensor in network.state_dict().items()}
    np.savez(stem.with_name(f"{stem.name}_weights.npz"), **weights)
    stem.with_name(f"{stem.name}.json").write_text(json.dumps(description))


def _encoder_outputs(network, batch):  # type: ignore[no-untyped-def]
    seen = {}
    for stage in (0, 1):
        name = f"out.encoder{stage + 1}_1"
        network.backbone.encoder[stage][0].register_forward_hook(
            lambda _, __, value, name=name: seen.__setitem__(name, value)
        )
    network.backbone(batch.features, batch.pyramid)
    return seen


def _matching(network, output, transform, pyramid):  # type: ignore[no-untyped-def]
    config, clouds = network.config, output.encoding
    targets = compute_targets(pyramid, transform, config)
    pairs = network.pair_up(clouds, output.superpoints.target, output.superpoints.source)
    assignment = network.assign(clouds, pairs)
    points = torch.cat([clouds.target.points, torch.zeros(1, 3)])[pairs.target_index]
    others = torch.cat([clouds.source.points, torch.zeros(1, 3)])[pairs.source_index]
    rows, columns = pairs.target_mask, pairs.source_mask
    found = output.matches
    pose = local_to_global(found.target, found.source, found.weight, found.group, config.lgr)
    dim = config.backbone.fine_dim
    padded = [torch.cat([c.point_features, torch.zeros(1, dim)]) for c in (clouds.target, clouds.source)]
    scores = padded[0][pairs.target_index[:4]] @ padded[1][pairs.source_index[:4]].transpose(1, 2) / dim**0.5
    fine = assignment_loss(
        assignment,
        pairs,
        clouds.target.points,
        clouds.source.points,
        transform,
        config.loss.positive_radius,
    )
    matches = {
        "ref_corr_points": found.target,
        "src_corr_points": found.source,
        "corr_scores": found.weight,
    }
    return {
        "out.gt_node_corr_indices": torch.stack([targets.target, targets.source], 1),
        "out.gt_node_corr_overlaps": targets.overlap,
        "out.ot_input_first4": scores,
        "out.ot_row_masks_first4": rows[:4],
        "out.ot_col_masks_first4": columns[:4],
        "out.matching_scores_first4": assignment[:4],
        **{f"out.{name}": value for name, value in matches.items()},
        "out.estimated_transform": pose.transform,
        "out.loss_coarse": circle_loss(
            *output.node_features, overlap_matrix(targets, output.kept), config.loss
        ),
        "out.loss_fine": fine,
        "lgr.in.ref_patch_points": points,
        "lgr.in.src_patch_points": others,
        "lgr.in.ref_patch_masks": rows,
        "lgr.in.src_patch_masks": columns,
        "lgr.in.log_scores": assignment[:, :-1, :-1],
        **{f"lgr.out.{name}": value for name, value in matches.items()},
        "lgr.out.transform": pose.transform,
    }


@pytest.mark.parametrize(
    "description",
    [plan(3, 8, 2, ["self", "cross"]), plan(4, 16, 8, ["self", "cross", "cross"]), plan(6, 4, 1, ["self"])],
    ids=["three stages", "four stages", "six stages"],
)
def test_other_plans(tmp_path: Path, description: dict) -> None:  # type: ignore[type-arg]
    from run import main

    torch.manual_seed(0)
    record(tmp_path / "made", description)
    assert main([str(tmp_path / "made")]) == 0
    with np.load(tmp_path / "made.npz") as arrays:
        values = dict(arrays)
    values["out.loss_fine"] = values["out.loss_fine"] + 1e-3
    np.savez(tmp_path / "made.npz", **values)
    assert main([str(tmp_path / "made")]) == 1


def test_points_at_the_radius_are_forgiven_and_counted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from compare import pairs_at_radius
    from plan import read_recording
    from run import main

    torch.manual_seed(0)
    description = plan(3, 8, 2, ["self", "cross"])
    record(tmp_path / "made", description)
    recording = read_recording(tmp_path / "made")
    config, want = recording.config, recording.values
    # The radius is moved onto a distance between two points: the recording counts them, we no longer do.
    points = recording.batch.pyramid.clouds(config.backbone.fine_stage - 1)
    moved = apply_transform(points[1], want["in.transform"])
    distance = torch.cdist(points[0].double(), moved.double(), compute_mode="donot_use_mm_for_euclid_dist")
    inside = float(distance[distance < config.matching.matching_radius].max())
    description["matching_radius"] = inside - 2e-6
    (tmp_path / "made.json").write_text(json.dumps(description))
    recording = read_recording(tmp_path / "made")
    targets = compute_targets(recording.batch.pyramid, want["in.transform"], recording.config)
    forgiven = pairs_at_radius(recording, targets)
    assert forgiven, "the radius was moved onto no patch's points"
    assert main([str(tmp_path / "made")]) == 0
    counted = next(line for line in capsys.readouterr().out.splitlines() if "forgiven" in line)
    assert f"{len(forgiven):.2e}" in counted
    # An overlap that is off by more than those points explain is not forgiven, nor one that no such point explains.
    for step in (1, -1):
        with np.load(tmp_path / "made.npz") as arrays:
            values = dict(arrays)
        pairs = [tuple(pair) for pair in values["out.gt_node_corr_indices"].tolist()]
        chosen = [(pair in forgiven) == (step == 1) for pair in pairs].index(True)
        values["out.gt_node_corr_overlaps"][chosen] += 2.0 * max(forgiven.values()) + 0.01
        np.savez(tmp_path / "spoiled.npz", **values)
        for name in ("spoiled.json", "spoiled_weights.npz"):
            (tmp_path / name).write_bytes((tmp_path / name.replace("spoiled", "made")).read_bytes())
        assert main([str(tmp_path / "spoiled")]) == 1
