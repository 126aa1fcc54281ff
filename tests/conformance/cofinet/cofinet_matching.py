# SPDX-License-Identifier: MIT
"""CoFiNet's recording: pairs of superpoints, patches, attention and transport of their points, matches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import torch
from arrays import Found, apart
from stacked import FEATURES
from torch import Tensor

from hybridreg.learned.cofinet.network import CofinetEncoding, CofinetNetwork
from hybridreg.learned.cofinet.patching import PatchIndex, patch_index
from hybridreg.learned.cofinet.point_transport import MASKED
from hybridreg.learned.cofinet.selection import NodePairs, select
from hybridreg.learned.cofinet.transformer import scores
from hybridreg.learned.layers.distances import squared_distances
from hybridreg.learned.pyramid.patches import build_patches

LOSS = 1e-4
# Below, an assignment is that of a place that no point fills: float32 has steps of 0.06 there.
_PADDED = -1e5
# Probabilities and weights this near to a threshold fall on either side of it.
THRESHOLD_TIE = 1e-4
# Log-assignments that differ by less are equally good.
_ASSIGNMENT_TIE = 3e-5
# Square metres: the expanded square's rounding at the clouds' distance from the origin.
_OWNER_TIE = 1e-3


def matching(network: CofinetNetwork, encoding: CofinetEncoding, want: Mapping[str, Tensor]) -> Found:
    """All that follows the transport between superpoints."""
    nodes, tried = select(encoding.log_assignment[:-1, :-1].exp(), network.config.selection)
    found, agreed = _selection(encoding, nodes, tried, want)
    found |= _patches(encoding, network.config.patch_points, want, "out.patch.")
    for name, cloud in (("src", encoding.source), ("ref", encoding.target)):
        found[f"out.point_to_node.{name}"] = _owners(
            cloud.points, cloud.nodes, want[f"out.point_to_node.{name}"]
        )
    patches = recorded_patches(want, "out.patch.")
    sides = (patches[0].take(agreed.source), patches[1].take(agreed.target))
    found |= _fine_blocks(network, encoding, sides, want)
    return found | _matches(network, encoding, agreed, patches, want)


def recorded_patches(want: Mapping[str, Tensor], prefix: str) -> tuple[PatchIndex, PatchIndex]:
    """The recorded patches of source and target, which ours were held against: what follows is judged on its own."""
    found = []
    for name in ("src", "ref"):
        index, count = want[f"{prefix}{name}"].long(), len(want[f"in.{name}_points"])
        found.append(PatchIndex(index.masked_fill(index < 0, count), index >= 0))
    return found[0], found[1]


def _selection(
    encoding: CofinetEncoding, nodes: NodePairs, tried: Any, want: Mapping[str, Tensor]
) -> tuple[Found, NodePairs]:
    """How many pairs are in one selection alone, but for those at the threshold; and the recorded selection."""
    recorded = want["out.node_corr"].long()
    probability = encoding.log_assignment[:-1, :-1].exp()
    every = {(int(s), int(t)) for s, t in zip(nodes.source, nodes.target, strict=True)}
    odd = every ^ {(int(s), int(t)) for s, t in recorded}
    thresholds = want["out.coarse_thresholds"].double()
    ours = torch.tensor([each.threshold for each in tried], dtype=torch.float64)
    # Where a count is off by pairs at its threshold, the search may end a step earlier or later.
    length = min(len(ours), len(thresholds))
    near = [int(((probability - float(t)).abs() < THRESHOLD_TIE).sum()) for t in thresholds]
    counts = torch.tensor([each.pairs for each in tried][:length])
    off = (counts - want["out.coarse_counts"][:length].long()).abs() - torch.tensor(near[:length])
    strange = sum(abs(float(probability[s, t]) - float(thresholds[-1])) >= THRESHOLD_TIE for s, t in odd)
    found: Found = {
        "out.coarse_thresholds": (apart(ours[:length], thresholds[:length]), 1e-9),
        "out.coarse_counts": (float(off.clamp_min(0).sum()), 0.0),
        "out.node_corr": (float(strange), 0.0),
        "out.node_corr_conf": (
            apart(probability[recorded[:, 0], recorded[:, 1]], want["out.node_corr_conf"]),
            LOSS,
        ),
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
        found[f"{prefix}{name}"] = patches_apart(patches, cloud.points, cloud.nodes, want[f"{prefix}{name}"])
    return found


def patches_apart(patches: PatchIndex, points: Tensor, nodes: Tensor, want: Tensor) -> tuple[float, float]:
    """How many patches differ, but for those that a point between two superpoints may belong to."""
    ours = patches.index.masked_fill(~patches.mask, -1)
    if ours.shape != want.shape:
        return math.inf, 0.0
    best = squared_distances(points, nodes).topk(min(2, len(nodes)), 1, largest=False)
    tied = best.values[:, -1] - best.values[:, 0] < _OWNER_TIE if len(nodes) > 1 else best.values[:, 0] < 0
    excused = set(best.indices[tied].flatten().tolist())
    rows = (ours != want.long()).any(1).nonzero()[:, 0].tolist()
    return float(sum(row not in excused for row in rows)), 0.0


def _fine_blocks(
    network: CofinetNetwork,
    encoding: CofinetEncoding,
    sides: tuple[PatchIndex, PatchIndex],
    want: Mapping[str, Tensor],
) -> Found:
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
            found[key] = (
                apart(named_steps("fine", clouds, done)[f"fine.{rest}"][: int(rows)], expected),
                FEATURES,
            )
        else:
            ours = similarity if head == "out.fine_scores" else assignment
            found[key] = assignments_apart(ours[: int(rows)], expected)
    return found


def named_steps(name: str, before: Any, done: list[Any]) -> dict[str, Tensor]:
    """Features of source and target before and after each step, by the recording's names."""
    named = zip(("before", "self1", "cross", "self2", "proj"), [before, *done], strict=True)
    return {
        f"{name}.{step}.{side}": rows
        for step, both in named
        for side, rows in zip(("src", "ref"), both, strict=True)
    }


def assignments_apart(value: Tensor, want: Tensor) -> tuple[float, float]:
    """Largest difference of assignments, where a point fills the place; which places that are must agree."""
    padded = want < _PADDED
    if value.shape != want.shape or not torch.equal(value < _PADDED, padded):
        return math.inf, FEATURES
    return apart(value[~padded], want[~padded]), FEATURES


def _matches(
    network: CofinetNetwork,
    encoding: CofinetEncoding,
    nodes: NodePairs,
    patches: tuple[PatchIndex, PatchIndex],
    want: Mapping[str, Tensor],
) -> Found:
    """Matches of the recorded pairs of superpoints; those that a tie of two assignments decides may be on one side."""
    found = network.match_points(encoding, nodes, patches)
    size = network.config.patch_points
    at = _slots(patches[0], nodes.source, found.source_index, found.group) + found.group * size
    to = _slots(patches[1], nodes.target, found.target_index, found.group) + found.group * size
    ours = {pair: i for i, pair in enumerate(zip(at.tolist(), to.tolist(), strict=True))}
    theirs = {tuple(pair): i for i, pair in enumerate(want["out.correspondences"].tolist())}
    tied = tied_matches(network, encoding, (patches[0].take(nodes.source), patches[1].take(nodes.target)))
    odd = [(s, t) for s, t in ours.keys() ^ theirs.keys() if not tied[s // size, s % size, t % size]]
    both = sorted(ours.keys() & theirs.keys())
    mine = torch.tensor([ours[pair] for pair in both], dtype=torch.int64)
    recorded = torch.tensor([theirs[pair] for pair in both], dtype=torch.int64)
    weight = want["out.correspondence_conf"]
    share = weight / weight.sum()
    values = {
        "correspondence_conf": (found.weight, LOSS),
        "src_corr_points": (found.source, LOSS),
        "ref_corr_points": (found.target, LOSS),
        "src_corr_indices": (found.source_index, 0.0),
        "ref_corr_indices": (found.target_index, 0.0),
    }
    compared: Found = {"out.correspondences": (float(len(odd)), 0.0)}
    for name, (value, tolerance) in values.items():
        compared[f"out.{name}"] = (apart(value[mine], want[f"out.{name}"][recorded]), tolerance)
    compared["out.sample_prob"] = (apart(share, want["out.sample_prob"]), 1e-6)
    return compared


def tied_matches(
    network: CofinetNetwork, encoding: CofinetEncoding, sides: tuple[PatchIndex, PatchIndex]
) -> Tensor:
    """(B, P, P): assignments that are the best of row or column, or as good up to rounding."""
    assignment = network.assign_points(encoding, sides)
    near = [assignment > assignment.amax(axis, keepdim=True) - _ASSIGNMENT_TIE for axis in (1, 2)]
    several = [each.sum(axis, keepdim=True) > 1 for each, axis in zip(near, (1, 2), strict=True)]
    return ((near[0] & several[0]) | (near[1] & several[1]))[:, :-1, :-1]


def _slots(patches: PatchIndex, nodes: Tensor, points: Tensor, group: Tensor) -> Tensor:
    return (patches.index[nodes[group]] == points[:, None]).to(torch.uint8).argmax(1)
