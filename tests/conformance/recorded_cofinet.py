# SPDX-License-Identifier: MIT
"""CoFiNet against its recording: every block, both transports, matches, truth, losses, and gradients."""

from __future__ import annotations

import math
from collections.abc import Mapping
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
from hybridreg.learned.cofinet.attention import scores
from hybridreg.learned.cofinet.config import CofinetConfig, CofinetLossConfig, SelectionConfig
from hybridreg.learned.cofinet.losses import cofinet_losses
from hybridreg.learned.cofinet.network import CofinetEncoding, CofinetNetwork
from hybridreg.learned.cofinet.official_names import UNUSED, official_name
from hybridreg.learned.cofinet.patching import PatchIndex, patch_index
from hybridreg.learned.cofinet.selection import NodePairs, select
from hybridreg.learned.cofinet.targets import (
    CofinetTargets,
    node_weights,
    training_patches,
    true_pairs,
    with_pairs,
)
from hybridreg.learned.cofinet.transport import MASKED, alternating_sinkhorn, either_best
from hybridreg.learned.distances import squared_distances
from hybridreg.learned.kpfcnn_names import load_stacked
from hybridreg.learned.patches import build_patches
from hybridreg.learned.procrustes import apply_transform
from hybridreg.learned.sinkhorn import log_sinkhorn

COARSE, LOSS = 1e-3, 1e-4
# Below, an assignment is that of a place that no point fills: float32 has steps of 0.06 there.
_PADDED = -1e5
# Probabilities and weights this near to a threshold fall on either side of it.
_THRESHOLD_TIE = 1e-4
_WEIGHT_TIE = 1e-6
# Square metres: the expanded square's rounding at the clouds' distance from the origin.
_OWNER_TIE = 1e-3


def compare(stem: Path) -> Found:
    """Largest difference and tolerance by recorded output."""
    plan = read_plan(stem)
    with np.load(stem.with_name(f"{stem.name}.npz")) as arrays:
        want = {name: torch.from_numpy(np.array(arrays[name])) for name in arrays.files}
    config = network_config(plan)
    network = CofinetNetwork(config)
    load_stacked(network, read_weights(stem), stem.name, official_name, UNUSED)
    batch = read_batch(want, config.backbone.stages)
    with torch.no_grad():
        encoding, found = _forward(network.eval(), batch, want)
        found |= _matching(network, encoding, want)
        targets, about_targets = _targets(batch, config, want)
        found |= about_targets
        fine = network.assign_points(encoding, targets.patches)
        found["loss.fine_log_assignment"] = _assignments_apart(fine, want["loss.fine_log_assignment"])
        key = "loss.coarse_log_assignment"
        found[key] = (apart(encoding.log_assignment, want[key]), COARSE)
    found |= _training(network, batch, targets, want, plan)
    found |= _transports(config, want) | _alone(config, want)
    inputs = ("in.", "ot.coarse.in", "ot.coarse.bin_score", "ot.fine.in", "ot.fine.node_conf", "synth.gt_")
    return complete(found, want, inputs)


def network_config(plan: Mapping[str, Any]) -> CofinetConfig:
    """Our configuration of a recorded plan."""
    coarse, fine, train = plan["coarse"], plan["fine"], plan["train"]
    selection = plan["coarse_selection"]
    if coarse.get("position_embedding") or fine.get("padding_masked_in_attention"):
        raise ValueError("CoFiNet as released has no position embedding and masks no padding in its attention")
    wanted = ["self", "cross", "self"]
    if coarse["blocks"] != wanted or fine["blocks"] != wanted:
        raise ValueError(f"blocks {coarse['blocks']} and {fine['blocks']}: the released weights have {wanted}")
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


def _forward(network: CofinetNetwork, batch: Batch, want: Mapping[str, Tensor]) -> tuple[CofinetEncoding, Found]:
    pyramid, last = batch.pyramid, batch.pyramid.stages - 1
    with EncoderOutputs(network.encoder, pyramid) as seen:
        features, skips = network.encoder(batch.features, pyramid)
    before = network.bottleneck(features)
    seen["bottle"] = recorded_order(before, pyramid, last)
    target, source = before.split(list(pyramid.lengths[-1]))
    seen |= _steps("coarse", (source, target), list(network.coarse.steps((source, target))))
    projected = seen["coarse.proj.src"], seen["coarse.proj.ref"]
    seen |= decoder_outputs(network.decoder, torch.cat([projected[1], projected[0]]), skips, pyramid)
    encoding = network.encode(batch)
    seen["feats"] = torch.cat([encoding.source.point_features, encoding.target.point_features])
    found = held(seen, want, "out.")
    found["out.coarse_scores"] = (apart(scores(projected), want["out.coarse_scores"]), COARSE)
    found["out.coarse_log_assignment"] = (
        apart(encoding.log_assignment, want["out.coarse_log_assignment"]),
        COARSE,
    )
    return encoding, found


def _steps(name: str, before: Any, done: list[Any]) -> dict[str, Tensor]:
    named = zip(("before", "self1", "cross", "self2", "proj"), [before, *done], strict=True)
    return {
        f"{name}.{step}.{side}": rows
        for step, both in named
        for side, rows in zip(("src", "ref"), both, strict=True)
    }


def _matching(network: CofinetNetwork, encoding: CofinetEncoding, want: Mapping[str, Tensor]) -> Found:
    nodes, tried = select(encoding.log_assignment[:-1, :-1].exp(), network.config.selection)
    found, agreed = _selection(encoding, nodes, tried, want)
    found |= _patches(encoding, network.config.patch_points, want, "out.patch.")
    for name, cloud in (("src", encoding.source), ("ref", encoding.target)):
        found[f"out.point_to_node.{name}"] = _owners(cloud.points, cloud.nodes, want[f"out.point_to_node.{name}"])
    patches = network.patches(encoding)
    sides = (patches[0].take(agreed.source), patches[1].take(agreed.target))
    found |= _fine_blocks(network, encoding, sides, want)
    return found | _matches(network, encoding, agreed, want)


def _selection(encoding: CofinetEncoding, nodes: NodePairs, tried: Any, want: Mapping[str, Tensor]) -> tuple[Found, NodePairs]:
    """How many pairs are in one selection alone, but for those at the threshold; and the recorded selection."""
    recorded = want["out.node_corr"].long()
    probability = encoding.log_assignment[:-1, :-1].exp()
    every = {(int(s), int(t)) for s, t in zip(nodes.source, nodes.target, strict=True)}
    odd = every ^ {(int(s), int(t)) for s, t in recorded}
    thresholds = want["out.coarse_thresholds"].double()
    ours = torch.tensor([each.threshold for each in tried], dtype=torch.float64)
    # Where a count is off by pairs at its threshold, the search may end a step earlier or later.
    length = min(len(ours), len(thresholds))
    near = [int(((probability - float(t)).abs() < _THRESHOLD_TIE).sum()) for t in thresholds]
    counts = torch.tensor([each.pairs for each in tried][:length])
    off = (counts - want["out.coarse_counts"][:length].long()).abs() - torch.tensor(near[:length])
    strange = sum(abs(float(probability[s, t]) - float(thresholds[-1])) >= _THRESHOLD_TIE for s, t in odd)
    found: Found = {
        "out.coarse_thresholds": (apart(ours[:length], thresholds[:length]), 1e-9),
        "out.coarse_counts": (float(off.clamp_min(0).sum()), 0.0),
        "out.node_corr": (float(strange), 0.0),
        "out.node_corr_conf": (apart(probability[recorded[:, 0], recorded[:, 1]], want["out.node_corr_conf"]), LOSS),
    }
    if len(ours) != len(thresholds):
        found["out.coarse_thresholds"] = (math.inf, 1e-9)
    return found, NodePairs(recorded[:, 0], recorded[:, 1], want["out.node_corr_conf"])


def _owners(points: Tensor, nodes: Tensor, want: Tensor) -> tuple[float, float]:
    """Square metres by which our superpoint is nearer or farther than the recorded one."""
    ours = build_patches(points, nodes, 1).owner
    distance = squared_distances(points, nodes)
    rows = torch.arange(len(points))
    return apart(distance[rows, ours], distance[rows, want.long()]), _OWNER_TIE


def _patches(encoding: CofinetEncoding, size: int, want: Mapping[str, Tensor], prefix: str) -> Found:
    found: Found = {}
    for name, cloud in (("src", encoding.source), ("ref", encoding.target)):
        patches = patch_index(cloud.points, cloud.nodes, size, "first")
        found[f"{prefix}{name}"] = _patches_apart(patches, cloud.points, cloud.nodes, want[f"{prefix}{name}"])
    return found


def _patches_apart(patches: PatchIndex, points: Tensor, nodes: Tensor, want: Tensor) -> tuple[float, float]:
    """How many patches differ, but for those that a point between two superpoints may belong to."""
    ours = patches.index.masked_fill(~patches.mask, -1)
    if ours.shape != want.shape:
        return math.inf, 0.0
    best = squared_distances(points, nodes).topk(min(2, len(nodes)), 1, largest=False)
    tied = best.values[:, -1] - best.values[:, 0] < _OWNER_TIE if len(nodes) > 1 else best.values[:, 0] < 0
    excused = set(best.indices[tied].flatten().tolist())
    rows = (ours != want.long()).any(1).nonzero()[:, 0].tolist()
    return float(sum(row not in excused for row in rows)), 0.0


def _fine_blocks(network: CofinetNetwork, encoding: CofinetEncoding, sides: tuple[PatchIndex, PatchIndex], want: Mapping[str, Tensor]) -> Found:
    clouds, masks = network.fine_input(encoding, sides)
    done = list(network.fine.steps(clouds, masks))
    valid = sides[0].mask[:, :, None] & sides[1].mask[:, None]
    similarity = scores(done[-1]).masked_fill(~valid, MASKED)
    assignment = network.assign_points(encoding, sides)
    found: Found = {}
    for key, expected in want.items():
        head, first, count = key.partition("_first")
        if not first or not key.startswith("out.fine"):
            continue
        rows, _, rest = count.partition(".")
        if head == "out.fine":
            found[key] = (apart(_steps("fine", clouds, done)[f"fine.{rest}"][: int(rows)], expected), FEATURES)
        else:
            ours = similarity if head == "out.fine_scores" else assignment
            found[key] = _assignments_apart(ours[: int(rows)], expected)
    return found


def _assignments_apart(value: Tensor, want: Tensor) -> tuple[float, float]:
    padded = want < _PADDED
    if value.shape != want.shape or not torch.equal(value < _PADDED, padded):
        return math.inf, FEATURES
    return apart(value[~padded], want[~padded]), FEATURES


def _matches(network: CofinetNetwork, encoding: CofinetEncoding, nodes: NodePairs, want: Mapping[str, Tensor]) -> Found:
    """Matches of the recorded pairs of superpoints."""
    found = network.match_points(encoding, nodes)
    size = network.config.patch_points
    patches = network.patches(encoding)
    at = _slots(patches[0], nodes.source, found.source_index, found.group) + found.group * size
    to = _slots(patches[1], nodes.target, found.target_index, found.group) + found.group * size
    pairs = torch.stack([at, to], 1)
    if pairs.shape != want["out.correspondences"].shape:
        names = ("correspondences", "correspondence_conf", "src_corr_points", "ref_corr_points", "src_corr_indices", "ref_corr_indices", "sample_prob")
        return {f"out.{name}": (math.inf, 0.0) for name in names}
    return {
        "out.correspondences": (float((pairs != want["out.correspondences"].long()).any(1).sum()), 0.0),
        "out.correspondence_conf": (apart(found.weight, want["out.correspondence_conf"]), LOSS),
        "out.src_corr_points": (apart(found.source, want["out.src_corr_points"]), LOSS),
        "out.ref_corr_points": (apart(found.target, want["out.ref_corr_points"]), LOSS),
        "out.src_corr_indices": (apart(found.source_index, want["out.src_corr_indices"]), 0.0),
        "out.ref_corr_indices": (apart(found.target_index, want["out.ref_corr_indices"]), 0.0),
        "out.sample_prob": (apart(found.weight / found.weight.sum(), want["out.sample_prob"]), LOSS),
    }


def _slots(patches: PatchIndex, nodes: Tensor, points: Tensor, group: Tensor) -> Tensor:
    return (patches.index[nodes[group]] == points[:, None]).to(torch.uint8).argmax(1)


def _targets(batch: Batch, config: CofinetConfig, want: Mapping[str, Tensor]) -> tuple[CofinetTargets, Found]:
    """Targets of the recorded draw. The truth that goes on is the recorded one where ours differs by a tie alone."""
    pyramid = batch.pyramid
    target, source = pyramid.clouds(0)
    nodes = pyramid.clouds(pyramid.stages - 1)
    pairs = tuple(want["in.correspondences"].long().t())
    owners = tuple(build_patches(p, n, 1).owner for p, n in ((source, nodes[1]), (target, nodes[0])))
    coarse = node_weights((pairs[0], pairs[1]), (owners[0], owners[1]), (len(nodes[1]), len(nodes[0])), config.loss.min_overlap)  # fmt: skip
    unfiltered = node_weights((pairs[0], pairs[1]), (owners[0], owners[1]), (len(nodes[1]), len(nodes[0])), 0.0)
    expected = want["loss.gt_matching_mask"]
    tied = (unfiltered - config.loss.min_overlap).abs() < _WEIGHT_TIE
    coarse = torch.where(tied, expected, coarse)
    drawn = want["loss.drawn_node_corr"].long()
    patches = training_patches(pyramid, config)
    moved = apply_transform(source, want["in.transform"])
    targets = with_pairs(coarse, drawn, patches, (moved, target), config)
    fine, recorded = targets.fine, want["loss.gt_fine"]
    at_radius = _at_radius(targets.patches, (moved, target), config.loss.fine_radius)
    fine = torch.where(at_radius, recorded, fine)
    known = {tuple(pair) for pair in want["loss.gt_node_corr"].tolist()}
    ours = {tuple(pair) for pair in true_pairs(coarse).tolist()}
    found: Found = {
        "loss.gt_matching_mask": (apart(coarse, expected), 1e-5),
        "loss.gt_node_corr": (float(len(ours ^ known)), 0.0),
        "loss.drawn_node_corr": (float(len({tuple(pair) for pair in drawn.tolist()} - ours) + abs(len(drawn) - config.loss.pairs)), 0.0),
        "loss.gt_fine": (apart(fine, recorded), 0.0),
    }
    for name, side, cloud, at in (("src", 0, source, nodes[1]), ("ref", 1, target, nodes[0])):
        found[f"loss.patch.{name}"] = _patches_apart(patches[side], cloud, at, want[f"loss.patch.{name}"])
    same = CofinetTargets(coarse=coarse, drawn=drawn, patches=targets.patches, fine=fine)
    return same, found


def _at_radius(patches: tuple[PatchIndex, PatchIndex], points: tuple[Tensor, Tensor], radius: float) -> Tensor:
    """(B, P + 1, P + 1): pairs within 1e-5 m of the radius, and the slack of both their points."""
    source, target = points[0][patches[0].filled], points[1][patches[1].filled]
    distance = torch.cdist(source, target, compute_mode="donot_use_mm_for_euclid_dist")
    tied = (distance - radius).abs() < TIE
    padded = torch.nn.functional.pad(tied, (0, 1, 0, 1))
    padded[:, :-1, -1], padded[:, -1, :-1] = tied.any(2), tied.any(1)
    return padded


def _training(network: CofinetNetwork, batch: Batch, targets: CofinetTargets, want: Mapping[str, Tensor], plan: Mapping[str, Any]) -> Found:
    names = {name: official_name(name) for name in network.state_dict()}
    network.train().zero_grad(set_to_none=True)
    losses = network.losses(network.encode(batch), targets)
    losses.total.backward()  # type: ignore[no-untyped-call]
    found: Found = {}
    for prefix in ("loss.out.", "train.out."):
        found |= {f"{prefix}{name}": (apart(value, want[f"{prefix}{name}"]), LOSS) for name, value in _parts(losses).items()}
    found |= gradients_apart(network, names, want, "train.")
    found["train.grad_norm"] = norms_apart(network, names, plan["train_grad_norm_names"], want["train.grad_norm"])
    network.eval().zero_grad(set_to_none=True)
    return found


def _parts(losses: Any) -> dict[str, Tensor]:
    return {
        "matching_loss": losses.coarse,
        "local_matching_loss": losses.fine,
        "total_loss": losses.total,
        "matching_recall": losses.coarse_recall,
        "local_matching_precision": losses.fine_precision,
    }


def _coarse(similarity: Tensor, bin_score: Tensor, iterations: int) -> Tensor:
    rows, columns = (torch.ones(1, count, dtype=torch.bool) for count in similarity.shape)
    return log_sinkhorn(similarity[None], rows, columns, bin_score, iterations)[0]


def _transports(config: CofinetConfig, want: Mapping[str, Tensor]) -> Found:
    """Both transports and both selections alone."""
    found: Found = {}
    for key, expected in want.items():
        if key.startswith(("ot.coarse.out", "ot.fine.out")):
            _, _, few = key.partition(".out_")
            iterations = int(few.partition("_")[0]) if few else config.sinkhorn_iterations
            if key.startswith("ot.coarse"):
                ours = _coarse(want["ot.coarse.in"], want["ot.coarse.bin_score"], iterations)
                found[key] = (apart(ours, expected), LOSS)
            else:
                found[key] = _assignments_apart(alternating_sinkhorn(want["ot.fine.in"], iterations), expected)
        elif key.startswith("ot.coarse.selected_at_"):
            threshold = float(key.rpartition("_")[2])
            probability = want["ot.coarse.out"][:-1, :-1].exp()
            rule = SelectionConfig(threshold=threshold, min_pairs=1, max_pairs=None)
            nodes, _ = select(probability, rule)
            found[key] = (apart(torch.stack([nodes.source, nodes.target], 1), expected), 0.0)
            found["ot.coarse.selected_conf"] = (apart(nodes.confidence, want["ot.coarse.selected_conf"]), LOSS)
    if "ot.fine.correspondences" in want:
        assignment = want["ot.fine.out"].exp()
        pair, row, column = either_best(assignment).nonzero(as_tuple=True)
        size = torch.tensor(assignment.shape[1:]) - 1
        at = torch.stack([pair * size[0] + row, pair * size[1] + column], 1)
        weight = assignment[pair, row, column] * want["ot.fine.node_conf"][pair]
        found["ot.fine.correspondences"] = (apart(at, want["ot.fine.correspondences"]), 0.0)
        found["ot.fine.conf"] = (apart(weight, want["ot.fine.conf"]), LOSS)
    return found


def _alone(config: CofinetConfig, want: Mapping[str, Tensor]) -> Found:
    """The losses on recorded scores."""
    if "synth.gt_fine" not in want:
        return {}
    inputs = {name: want[f"ot.{name}"].clone().requires_grad_() for name in ("coarse.in", "coarse.bin_score", "fine.in")}
    coarse = _coarse(inputs["coarse.in"], inputs["coarse.bin_score"], config.sinkhorn_iterations)
    fine = alternating_sinkhorn(inputs["fine.in"], config.sinkhorn_iterations)
    none = PatchIndex(torch.zeros(0, 1, dtype=torch.int64), torch.zeros(0, 1, dtype=torch.bool))
    targets = CofinetTargets(coarse=want["synth.gt_matching_mask"], drawn=torch.zeros(0, 2), patches=(none, none), fine=want["synth.gt_fine"])  # fmt: skip
    losses = cofinet_losses(coarse, fine, targets, config.loss)
    losses.total.backward()  # type: ignore[no-untyped-call]
    found = {f"synth.out.{name}": (apart(value, want[f"synth.out.{name}"]), LOSS) for name, value in _parts(losses).items()}
    for name, key in (("coarse.in", "coarse_in"), ("coarse.bin_score", "bin_score"), ("fine.in", "fine_in")):
        gradient = inputs[name].grad
        assert gradient is not None
        found[f"synth.grad_{key}"] = (apart(gradient, want[f"synth.grad_{key}"]), LOSS)
    return found
