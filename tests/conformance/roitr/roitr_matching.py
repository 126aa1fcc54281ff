# SPDX-License-Identifier: MIT
"""RoITr's matching, targets, losses and gradients against a recording."""

from __future__ import annotations

import torch
from arrays import apart
from roitr_plan import RoitrRecording
from ties import TIE, Compared, rows_apart
from torch import Tensor

from hybridreg.learned.cross3dreg.network import CloudEncoding
from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.matching.procrustes import apply_transform, weighted_procrustes
from hybridreg.learned.matching.superpoint_matching import SuperpointMatches, match_superpoints
from hybridreg.learned.pyramid.patches import Patches
from hybridreg.learned.roitr.losses import losses, right_shares, validation_losses
from hybridreg.learned.roitr.network import RoitrOutput
from hybridreg.learned.roitr.official_names import official_name
from hybridreg.learned.roitr.superpoint_pairs import match_adaptively
from hybridreg.learned.roitr.targets import RoitrTargets, compute_targets, visible_shares

MODULE, CHAIN = 1e-4, 2e-3
# The scores of padded entries are some -1e6 there and -1e12 here: neither means anything.
_PADDED = -1e5
_RADIUS_TIE = 1e-5  # metres


def compare_matching(recording: RoitrRecording, found: Compared) -> None:
    """Superpoint pairs, transport and point matches, on the recorded features where these are whole."""
    values, config = recording.values, recording.config
    target, source = recording.network.encode(recording.batch)
    target, source = _with_recorded(recording, target, "tgt"), _with_recorded(recording, source, "src")
    targets = _targets(recording, target, source, found)
    superpoints = _superpoints(recording, target, source, found)
    _adaptive(recording, target, source, found)
    _transport(recording, target, source, superpoints, found)
    matches = recording.network.match_points(target, source, superpoints)
    names = ("out.tgt_corr_points", "out.src_corr_points", "out.corr_scores")
    # A score at the threshold may fall on either side of it: the page's own float64 run loses one row.
    allowed = _at_threshold(values["out.corr_scores"], config.matching.confidence)
    columns = [matches.target, matches.source, matches.weight]
    apart_by, lonely = rows_apart(columns, [values[name] for name in names], forgiven=allowed)
    if lonely:
        found.ties["out.corr_points"] = lonely
    found.values |= {name: (value, CHAIN) for name, value in zip(names, apart_by, strict=True)}
    recorded = weighted_procrustes(values[names[1]], values[names[0]], values[names[2]])
    found.close("out.procrustes_transform (module)", recorded, values["out.procrustes_transform"], CHAIN)
    own = weighted_procrustes(matches.source, matches.target, matches.weight)
    # Random weights match at random: what one match more moves is not bounded, so it is compared where all are there.
    found.close(
        "out.procrustes_transform", recorded if lonely else own, values["out.procrustes_transform"], CHAIN
    )
    output = RoitrOutput(target=target, source=source, superpoints=superpoints, matches=matches)
    made = validation_losses(recording.network, output, targets)
    for name, value in (
        ("out.loss_coarse", made.coarse),
        ("out.loss_fine", made.fine),
        ("out.loss", made.total),
    ):
        found.close(name, value, values[name], CHAIN)
    evaluation = recording.plan["evaluation"]
    pir, ir = right_shares(output, targets, evaluation["acceptance_radius"], evaluation["acceptance_overlap"])
    found.close("out.PIR", torch.tensor(pir), values["out.PIR"], 1e-6)
    found.close("out.IR", torch.tensor(ir), values["out.IR"], MODULE + 2.0 * lonely / max(1, len(matches)))


def compare_training(recording: RoitrRecording, found: Compared) -> None:
    """Losses of the recorded training step, and gradients of the recorded parameters."""
    values, network = recording.values, recording.network
    network.train()
    network.zero_grad()
    target, source = network.encode(recording.batch)
    nodes = [values[f"train.in.{side}_node_corr_indices"] for side in ("tgt", "src")]
    truth = compute_targets(recording.batch, values["in.transform"], recording.config)
    place = {pair: i for i, pair in enumerate(zip(truth.target.tolist(), truth.source.tolist(), strict=True))}
    drawn = [place.get(pair, -1) for pair in zip(nodes[0].tolist(), nodes[1].tolist(), strict=True)]
    if min(drawn) < 0:
        found.values["train.in: a drawn pair is not among ours"] = (float("inf"), 0.0)
        return
    targets = RoitrTargets(
        transform=truth.transform,
        target=truth.target,
        source=truth.source,
        overlap=truth.overlap,
        drawn=torch.tensor(drawn),
    )
    found.close(
        "train.in.node_corr_overlaps",
        truth.overlap[targets.drawn],
        values["train.in.node_corr_overlaps"],
        MODULE,
    )
    none = SuperpointMatches(*nodes, torch.ones(len(nodes[0])))
    output = RoitrOutput(
        target=target,
        source=source,
        superpoints=none,
        matches=network.match_points(target, source, none),
    )
    made = losses(network, output, targets)
    for name, value in (("loss_coarse", made.coarse), ("loss_fine", made.fine), ("loss", made.total)):
        found.close(f"train.out.{name}", value, values[f"train.out.{name}"], CHAIN)
    with torch.no_grad():
        clouds = _with_recorded(recording, target, "tgt"), _with_recorded(recording, source, "src")
        name = next(n for n in values if n.startswith("train.out.matching_scores_first"))
        pairs = network.pair_up(*clouds, *nodes).take(torch.arange(len(values[name])))
        large = float(network.scores(*clouds, pairs).abs().max())
        _assignments(name, network.assign(*clouds, pairs), values[name], found, large)
    made.total.backward()
    gradients = {official_name(n): p.grad for n, p in network.named_parameters()}
    for name in (n for n in values if n.startswith("train.grad.")):
        want = values[name]
        own = gradients[name.removeprefix("train.grad.")]
        # Relative where gradients are large: the page's own float64 run moves them by 2e-5 of their size.
        found.close(name, own, want, max(MODULE, 2e-4 * float(want.abs().max())))
    network.eval()


def _with_recorded(recording: RoitrRecording, cloud: CloudEncoding, side: str) -> CloudEncoding:
    values = recording.values
    return CloudEncoding(
        nodes=cloud.nodes,
        node_features=values[f"out.{side}_node_feats"],
        points=cloud.points,
        point_features=recording.network.fine_proj(values[f"out.{side}.dec.1"]),
        patches=Patches(
            values[f"out.{side}.point_to_node"],
            values[f"out.{side}.node_knn_indices"],
            values[f"out.{side}.node_knn_masks"],
        ),
    )


def _targets(
    recording: RoitrRecording, target: CloudEncoding, source: CloudEncoding, found: Compared
) -> RoitrTargets:
    values, config = recording.values, recording.config
    targets = compute_targets(recording.batch, values["in.transform"], config)
    shape = len(target.nodes), len(source.nodes)
    own, want = torch.zeros(shape), torch.zeros(shape)
    own[targets.target, targets.source] = targets.overlap
    index = values["out.gt_node_corr_indices"]
    want[index[:, 0], index[:, 1]] = values["out.gt_node_corr_overlaps"]
    # One point pair at the radius moves a share by one point's part: forgiven where such a pair is there, and counted.
    near = _radius_ties(target, source, values["in.transform"], config.matching.matching_radius)
    differing = (own - want).abs() > MODULE
    if bool((differing & near).any()):
        found.ties["out.gt_node_corr_overlaps"] = int((differing & near).sum())
    wrong = differing & ~near
    found.values["out.gt_node_corr_indices"] = (float(((own > 0) != (want > 0))[~near].sum()), 0.0)
    calm = torch.where(differing & near, want, own)
    found.values["out.gt_node_corr_overlaps"] = (
        apart(calm, want) if not wrong.any() else float("inf"),
        MODULE,
    )
    _shares(recording, target, source, found)
    return targets


def _shares(recording: RoitrRecording, target: CloudEncoding, source: CloudEncoding, found: Compared) -> None:
    # A point whose nearest one lies at the radius may count or not: between both shares everything is right.
    clouds = (target.points, source.points), (target.patches, source.patches)
    low, own, high = (
        visible_shares(*clouds, recording.values["in.transform"], recording.config.occlusion_radius + by)
        for by in (-_RADIUS_TIE, 0.0, _RADIUS_TIE)
    )
    for i, side in enumerate(("tgt", "src")):
        name = f"out.gt_{side}_node_occ"
        want = recording.values[name]
        tied = (low[i] != high[i]) & (want >= low[i] - MODULE) & (want <= high[i] + MODULE)
        if bool((tied & ((own[i] - want).abs() > MODULE)).any()):
            found.ties[name] = int(tied.sum())
        found.close(name, torch.where(tied, want, own[i]), want, MODULE)


def _radius_ties(target: CloudEncoding, source: CloudEncoding, transform: Tensor, radius: float) -> Tensor:
    """(m, n) bool: superpoint pairs with a pair of points whose distance is the radius to 1e-5."""
    moved = apply_transform(source.points, transform)
    squares = squared_distances(target.points, moved)
    exact = torch.cdist(target.points.double(), moved.double())
    # Near in truth, or in the rounding of the expanded square by which the original decides.
    tie = ((exact - radius).abs() < _RADIUS_TIE) | ((squares.sqrt() - radius).abs() < _RADIUS_TIE)
    rows, columns = tie.nonzero(as_tuple=True)
    found = torch.zeros(len(target.nodes), len(source.nodes), dtype=torch.bool)
    found[target.patches.owner[rows], source.patches.owner[columns]] = True
    return found


def _superpoints(
    recording: RoitrRecording, target: CloudEncoding, source: CloudEncoding, found: Compared
) -> SuperpointMatches:
    values = recording.values
    own = recording.network.match_superpoints(target, source)
    want = [values[f"out.{side}_node_corr_indices"] for side in ("tgt", "src")]
    names = ("out.tgt_node_corr_indices", "out.src_node_corr_indices")
    if own.target.shape != want[0].shape:
        found.values |= dict.fromkeys(names, (float("inf"), 0.0))
        return SuperpointMatches(want[0], want[1], values["out.node_corr_scores"])
    every = _every_score(recording, target, source)
    gaps = (every[want[0], want[1]] / own.score - 1.0).abs()
    differing = (own.target != want[0]) | (own.source != want[1])
    for name in names:
        found.tied(name, differing, gaps, TIE)
    found.close("out.node_corr_scores", own.score, values["out.node_corr_scores"], MODULE)
    return SuperpointMatches(want[0], want[1], own.score)


def _every_score(recording: RoitrRecording, target: CloudEncoding, source: CloudEncoding) -> Tensor:
    rows = [cloud.patches.occupied.nonzero()[:, 0] for cloud in (target, source)]
    features = [cloud.node_features[index] for cloud, index in zip((target, source), rows, strict=True)]
    every = len(rows[0]) * len(rows[1])
    if recording.config.coarse == "adaptive":
        found = match_adaptively(features[0], features[1], every, 2.0)
    else:
        found = match_superpoints(features[0], features[1], every)
    scores = torch.full((len(target.nodes), len(source.nodes)), -1.0)
    scores[rows[0][found.target], rows[1][found.source]] = found.score
    return scores


def _adaptive(
    recording: RoitrRecording, target: CloudEncoding, source: CloudEncoding, found: Compared
) -> None:
    values, plan = recording.values, recording.plan["adaptive_matching"]
    rows = [cloud.patches.occupied.nonzero()[:, 0] for cloud in (target, source)]
    features = [cloud.node_features[index] for cloud, index in zip((target, source), rows, strict=True)]
    own = match_adaptively(features[0], features[1], plan["minimum"], plan["similarity_threshold"])
    found.close("adaptive.out.scores", own.score, values["adaptive.out.scores"], MODULE)
    want = [values[f"adaptive.out.{side}_indices"] for side in ("tgt", "src")]
    for side, index, expected in zip(("tgt", "src"), (own.target, own.source), want, strict=True):
        name = f"adaptive.out.{side}_indices"
        if index.shape != expected.shape:
            found.values[name] = (float("inf"), 0.0)
            continue
        given = (target.node_features[want[0]] * source.node_features[want[1]]).sum(1)
        score = torch.exp(-(2.0 - 2.0 * given).clamp_min(0.0).sqrt())
        found.tied(
            name, rows[0 if side == "tgt" else 1][index] != expected, (own.score - score).abs(), MODULE
        )


def _transport(
    recording: RoitrRecording,
    target: CloudEncoding,
    source: CloudEncoding,
    superpoints: SuperpointMatches,
    found: Compared,
) -> None:
    values, network = recording.values, recording.network
    name = next(n for n in values if n.startswith("out.ot_input_first"))
    end = name.removeprefix("out.ot_input_")
    count = len(values[name])
    pairs = network.pair_up(target, source, superpoints.target[:count], superpoints.source[:count])
    rows, columns = values[f"out.ot_row_masks_{end}"], values[f"out.ot_col_masks_{end}"]
    found.same(f"out.ot_row_masks_{end}", pairs.target_mask, rows)
    found.same(f"out.ot_col_masks_{end}", pairs.source_mask, columns)
    valid = rows[:, :, None] & columns[:, None]
    scores = network.scores(target, source, pairs)
    found.close(name, scores[valid], values[name][valid], CHAIN)
    want = values[f"out.matching_scores_{end}"]
    large = float(values[name].abs().max())
    for form in ("log", "kernel"):
        own = network.transport(values[name], rows, columns, form)
        _assignments(
            f"out.matching_scores_{end}" + ("" if form == "log" else " (kernel)"), own, want, found, large
        )


def _assignments(name: str, own: Tensor, want: Tensor, found: Compared, large: float) -> None:
    """Unmasked entries; float32 leaves 1e-6 of the largest score that was summed."""
    padded = want < _PADDED
    if own.shape != want.shape or not torch.equal(own < _PADDED, padded):
        found.values[name] = (float("inf"), 0.0)
        return
    found.close(name, own[~padded], want[~padded], max(MODULE, 5e-6 * large))


def _at_threshold(scores: Tensor, threshold: float) -> int:
    """How many recorded scores lie so near the threshold that rounding decides, with a few more for the other side."""
    near = int((scores < threshold + MODULE).sum())
    return 2 + 2 * near
