# SPDX-License-Identifier: MIT
"""Run a network on its recording and measure the largest difference of every recorded output."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import torch
from arrays import apart, unequal
from plan import Recording
from scipy.spatial import cKDTree
from torch import Tensor

from hybridreg.learned.cross3dreg.losses import overlap_matrix
from hybridreg.learned.cross3dreg.network import Output
from hybridreg.learned.cross3dreg.targets import Targets, compute_targets
from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.losses.circle_loss import circle_loss
from hybridreg.learned.losses.fine_loss import assignment_loss
from hybridreg.learned.matching.local_to_global import local_to_global
from hybridreg.learned.matching.point_matching import mutual_top_k
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.matching.superpoint_matching import SuperpointMatches, match_superpoints
from hybridreg.learned.pyramid.patches import build_patches

# The log-assignment of a padded entry is minus infinity up to rounding: about -1e12, where neighbouring
# float32 numbers are 65536 apart. Both sides must be below this; their difference means nothing.
_PADDED = -1e6
# Relative: some ten units in the last place of float32.
_TIE = 5e-6
# Metres: a distance this near to a radius falls on either side of it; and overlaps that differ by no more are the same.
_AT_RADIUS, _SAME = 1e-5, 1e-5


@torch.no_grad()
def differences(recording: Recording) -> dict[str, float]:
    """Largest absolute difference by output; infinity where shapes or indices differ."""
    want = recording.values
    blocks, output = _forward(recording)
    targets = compute_targets(recording.batch.pyramid, want["in.transform"], recording.config)
    found = {f"out.{name}": apart(value, want[f"out.{name}"]) for name, value in blocks.items()}
    found |= _superpoints(recording, output)
    at_radius = pairs_at_radius(recording, targets)
    found |= _targets(targets, want, at_radius)
    if at_radius:
        # What follows is judged on its own.
        index, overlap = want["out.gt_node_corr_indices"], want["out.gt_node_corr_overlaps"]
        targets = replace(targets, target=index[:, 0].long(), source=index[:, 1].long(), overlap=overlap)
    found |= _transport(recording, output)
    found |= _correspondences(recording, output)
    found |= _losses(recording, output, targets)
    return found | _lgr_alone(recording)


def _forward(recording: Recording) -> tuple[dict[str, Tensor], Output]:
    network, seen = recording.network, {}
    encoder = network.backbone.encoder
    hooks = [
        encoder[stage][0].register_forward_hook(  # type: ignore[index]
            lambda _, __, value, stage=stage: seen.__setitem__(f"encoder{stage + 1}_1", value)
        )
        for stage in (0, 1)
    ]
    seen["feats_coarse"], seen["feats_fine"] = network.backbone(
        recording.batch.features, recording.batch.pyramid
    )
    for hook in hooks:
        hook.remove()
    output = network(recording.batch)
    assert network.transformer.embedding is not None
    embedding = network.transformer.embedding(output.encoding.source.nodes)
    seen["src_geo_embedding_first32"] = embedding[:32, :32]
    seen["ref_feats_c"], seen["src_feats_c"] = output.node_features
    return seen, output


def _superpoints(recording: Recording, output: Output) -> dict[str, float]:
    """0 where the sequences are equal; else the largest relative gap of the scores that changed places.

    Two float32 computations order scores that agree to their last digits differently: that alone is forgiven.
    """
    want, found = recording.values, output.superpoints
    pairs = torch.stack([want["out.ref_node_corr_indices"], want["out.src_node_corr_indices"]])
    names = ("out.ref_node_corr_indices", "out.src_node_corr_indices")
    ours = torch.stack([found.target, found.source])
    if ours.shape != pairs.shape:
        return dict.fromkeys(names, math.inf)
    every = _all_scores(recording, output)
    gap = (every[pairs[0], pairs[1]] / found.score - 1.0).abs()[(ours != pairs).any(0)]
    largest = float(gap.max()) if len(gap) else 0.0
    return dict.fromkeys(names, largest if largest < _TIE else math.inf)


def _all_scores(recording: Recording, output: Output) -> Tensor:
    """(m, n) scores of all pairs; -1 where a superpoint owns no fine points."""
    clouds, config = output.encoding, recording.config.matching
    owning = [cloud.patches.occupied.nonzero()[:, 0] for cloud in (clouds.target, clouds.source)]
    features = [features[index] for features, index in zip(output.node_features, owning, strict=True)]
    found = match_superpoints(*features, len(owning[0]) * len(owning[1]), dual=config.dual_normalization)
    scores = torch.full((len(clouds.target.nodes), len(clouds.source.nodes)), -1.0)
    scores[owning[0][found.target], owning[1][found.source]] = found.score
    return scores


def _recorded_pairs(recording: Recording, output: Output) -> SuperpointMatches:
    """Ours where they are the recorded set, else the recorded ones: what follows is judged on its own."""
    want, found = recording.values, output.superpoints
    target, source = want["out.ref_node_corr_indices"], want["out.src_node_corr_indices"]
    same = set(zip(target.tolist(), source.tolist(), strict=True)) == set(
        zip(found.target.tolist(), found.source.tolist(), strict=True)
    )
    return found if same else SuperpointMatches(target, source, torch.ones(len(target)))


def _targets(
    targets: Targets, want: dict[str, Tensor], at_radius: dict[tuple[int, int], float]
) -> dict[str, float]:
    """Pairs in one truth alone, and largest difference of the overlaps, but for what points at the radius explain."""
    recorded = _overlaps(want["out.gt_node_corr_indices"], want["out.gt_node_corr_overlaps"])
    ours = _overlaps(torch.stack([targets.target, targets.source], 1), targets.overlap)
    if len(want["out.gt_node_corr_indices"]) != len(want["out.gt_node_corr_overlaps"]):
        return dict.fromkeys(("out.gt_node_corr_indices", "out.gt_node_corr_overlaps"), math.inf)
    alone = [pair for pair in recorded.keys() ^ ours.keys() if pair not in at_radius]
    apart = [abs(value - ours.get(pair, 0.0)) - at_radius.get(pair, 0.0) for pair, value in recorded.items()]
    apart += [value - at_radius.get(pair, 0.0) for pair, value in ours.items() if pair not in recorded]
    return {
        "out.gt_node_corr_indices": math.inf if alone else 0.0,
        "out.gt_node_corr_overlaps": max([0.0, *apart]),
    }


def _overlaps(index: Tensor, overlap: Tensor) -> dict[tuple[int, int], float]:
    return {(int(i), int(j)): float(o) for (i, j), o in zip(index, overlap, strict=False)}


def pairs_at_radius(recording: Recording, targets: Targets) -> dict[tuple[int, int], float]:
    """Pairs of patches with different overlaps that hold points within 1e-5 m of the radius.

    With each how far its overlap may be off: such points count or do not, by the last digit of float32.
    """
    want, config = recording.values, recording.config
    recorded = _overlaps(want["out.gt_node_corr_indices"], want["out.gt_node_corr_overlaps"])
    ours = _overlaps(torch.stack([targets.target, targets.source], 1), targets.overlap)
    odd = [p for p in recorded.keys() | ours.keys() if abs(recorded.get(p, 0.0) - ours.get(p, 0.0)) > _SAME]
    nodes = recording.batch.pyramid.clouds(config.backbone.stages - 1)
    clouds = recording.batch.pyramid.clouds(config.backbone.fine_stage - 1)
    patches = [build_patches(c, n, config.matching.patch_points) for c, n in zip(clouds, nodes, strict=True)]
    moved = (clouds[0], apply_transform(clouds[1], targets.transform))
    found = {}
    for i, j in odd:
        first, second = (
            cloud[patch.index[node][patch.mask[node]]]
            for cloud, patch, node in zip(moved, patches, (i, j), strict=True)
        )
        exact = torch.cdist(first.double(), second.double(), compute_mode="donot_use_mm_for_euclid_dist")
        expanded = squared_distances(first, second).sqrt()
        tied = [(d - config.matching.matching_radius).abs() < _AT_RADIUS for d in (exact, expanded)]
        rows, columns = (int((tied[0] | tied[1]).any(axis).sum()) for axis in (1, 0))
        if rows:
            found[i, j] = (rows / len(first) + columns / len(second)) / 2
    return found


def _transport(recording: Recording, output: Output) -> dict[str, float]:
    """From the recorded scores in both forms, and from our own features."""
    want, network = recording.values, recording.network
    rows, columns = want["out.ot_row_masks_first4"], want["out.ot_col_masks_first4"]
    scores, expected = want["out.ot_input_first4"], want["out.matching_scores_first4"]
    count = len(scores)
    nodes = want["out.ref_node_corr_indices"][:count], want["out.src_node_corr_indices"][:count]
    pairs = network.pair_up(output.encoding, *nodes)
    masks = {"row": (pairs.target_mask, rows), "col": (pairs.source_mask, columns)}
    found = {f"out.ot_{name}_masks_first4": unequal(*both) for name, both in masks.items()}
    same = not any(found.values())
    own = network.assign(output.encoding, pairs) if same else expected * math.inf
    given = network.scores(output.encoding, pairs) if same else scores * math.inf
    seen = rows[:, :, None] & columns[:, None]
    return found | {
        "out.ot_input_first4": apart(given[seen], scores[seen]),
        "out.matching_scores_first4": _assignments_apart(network.transport(scores, rows, columns), expected),
        "out.matching_scores_first4 (kernel)": _assignments_apart(
            network.transport(scores, rows, columns, "kernel"), expected
        ),
        "out.matching_scores_first4 (own scores)": _assignments_apart(own, expected),
    }


def _assignments_apart(value: Tensor, want: Tensor) -> float:
    padded = want < _PADDED
    if value.shape != want.shape or not torch.equal(value < _PADDED, padded):
        return math.inf
    return apart(value[~padded], want[~padded])


def _correspondences(recording: Recording, output: Output) -> dict[str, float]:
    want = recording.values
    found = recording.network.match_points(output.encoding, _recorded_pairs(recording, output))
    pose = local_to_global(found.target, found.source, found.weight, found.group, recording.config.lgr)
    sets = _rows_apart(
        (found.target, found.source, found.weight),
        (want["out.ref_corr_points"], want["out.src_corr_points"], want["out.corr_scores"]),
    )
    names = ("out.ref_corr_points", "out.src_corr_points", "out.corr_scores")
    return dict(zip(names, sets, strict=True)) | {
        "out.estimated_transform": apart(pose.transform, want["out.estimated_transform"])
    }


def _rows_apart(ours: tuple[Tensor, Tensor, Tensor], theirs: tuple[Tensor, Tensor, Tensor]) -> list[float]:
    """Differences of rows matched as a multiset, one to one."""
    if any(a.shape != b.shape for a, b in zip(ours, theirs, strict=True)):
        return [math.inf] * 3
    rows = [
        np.hstack([p.numpy(), q.numpy(), w.numpy()[:, None]]).astype(np.float64) for p, q, w in (ours, theirs)
    ]
    _, partner = cKDTree(rows[1]).query(rows[0])
    if len(np.unique(partner)) < len(partner):  # equal rows: sorting pairs them up as well
        rows = [r[np.lexsort(np.round(r, 3).T)] for r in rows]
        partner = np.arange(len(partner))
    apart = np.abs(rows[0] - rows[1][partner])
    return [float(block.max(initial=0.0)) for block in (apart[:, :3], apart[:, 3:6], apart[:, 6:])]


def _losses(recording: Recording, output: Output, targets: Targets) -> dict[str, float]:
    want, network, config = recording.values, recording.network, recording.config
    clouds = output.encoding
    coarse = circle_loss(*output.node_features, overlap_matrix(targets, output.kept), config.loss)
    nodes = _recorded_pairs(recording, output)
    pairs = network.pair_up(clouds, nodes.target, nodes.source)
    fine = assignment_loss(
        network.assign(clouds, pairs),
        pairs,
        clouds.target.points,
        clouds.source.points,
        targets.transform,
        config.loss.positive_radius,
    )
    return {
        "out.loss_coarse": apart(coarse, want["out.loss_coarse"]),
        "out.loss_fine": apart(fine, want["out.loss_fine"]),
    }


def _lgr_alone(recording: Recording) -> dict[str, float]:
    want, config = recording.values, recording.config
    rows, columns = want["lgr.in.ref_patch_masks"], want["lgr.in.src_patch_masks"]
    probability = want["lgr.in.log_scores"].exp()
    fine = config.matching
    chosen = mutual_top_k(
        probability, rows, columns, topk=fine.topk, threshold=fine.confidence, mutual=fine.mutual
    )
    pair, row, column = chosen.nonzero(as_tuple=True)
    target, source = want["lgr.in.ref_patch_points"][pair, row], want["lgr.in.src_patch_points"][pair, column]
    pose = local_to_global(target, source, probability[chosen], pair, config.lgr)
    expected = tuple(
        want[f"lgr.out.{name}"] for name in ("ref_corr_points", "src_corr_points", "corr_scores")
    )
    sets = _rows_apart((target, source, probability[chosen]), (expected[0], expected[1], expected[2]))
    names = ("lgr.out.ref_corr_points", "lgr.out.src_corr_points", "lgr.out.corr_scores")
    return dict(zip(names, sets, strict=True)) | {
        "lgr.out.transform": apart(pose.transform, want["lgr.out.transform"])
    }
