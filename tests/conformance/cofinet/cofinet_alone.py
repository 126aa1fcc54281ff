# SPDX-License-Identifier: MIT
"""CoFiNet's recording: both transports and the losses alone, on recorded scores."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from arrays import Found, apart
from cofinet_matching import assignments_apart
from cofinet_training import named_parts
from torch import Tensor

from hybridreg.learned.cofinet.config import CofinetConfig, SelectionConfig
from hybridreg.learned.cofinet.losses import cofinet_losses
from hybridreg.learned.cofinet.patching import PatchIndex
from hybridreg.learned.cofinet.point_transport import alternating_sinkhorn, either_best
from hybridreg.learned.cofinet.selection import select
from hybridreg.learned.cofinet.targets import CofinetTargets
from hybridreg.learned.matching.sinkhorn import log_sinkhorn

LOSS = 1e-4


def _coarse(similarity: Tensor, bin_score: Tensor, iterations: int) -> Tensor:
    rows, columns = (torch.ones(1, count, dtype=torch.bool) for count in similarity.shape)
    return log_sinkhorn(similarity[None], rows, columns, bin_score, iterations)[0]


def transports(config: CofinetConfig, want: Mapping[str, Tensor]) -> Found:
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
                found[key] = assignments_apart(alternating_sinkhorn(want["ot.fine.in"], iterations), expected)
        elif key.startswith("ot.coarse.selected_at_"):
            threshold = float(key.rpartition("_")[2])
            probability = want["ot.coarse.out"][:-1, :-1].exp()
            rule = SelectionConfig(threshold=threshold, min_pairs=1, max_pairs=None)
            nodes, _ = select(probability, rule)
            found[key] = (apart(torch.stack([nodes.source, nodes.target], 1), expected), 0.0)
            found["ot.coarse.selected_conf"] = (
                apart(nodes.confidence, want["ot.coarse.selected_conf"]),
                LOSS,
            )
    if "ot.fine.correspondences" in want:
        assignment = want["ot.fine.out"].exp()
        pair, row, column = either_best(assignment).nonzero(as_tuple=True)
        size = torch.tensor(assignment.shape[1:]) - 1
        at = torch.stack([pair * size[0] + row, pair * size[1] + column], 1)
        weight = assignment[pair, row, column] * want["ot.fine.node_conf"][pair]
        found["ot.fine.correspondences"] = (apart(at, want["ot.fine.correspondences"]), 0.0)
        found["ot.fine.conf"] = (apart(weight, want["ot.fine.conf"]), LOSS)
    return found


def losses_alone(config: CofinetConfig, want: Mapping[str, Tensor]) -> Found:
    """The losses on recorded scores."""
    if "synth.gt_fine" not in want:
        return {}
    inputs = {
        name: want[f"ot.{name}"].clone().requires_grad_()
        for name in ("coarse.in", "coarse.bin_score", "fine.in")
    }
    coarse = _coarse(inputs["coarse.in"], inputs["coarse.bin_score"], config.sinkhorn_iterations)
    fine = alternating_sinkhorn(inputs["fine.in"], config.sinkhorn_iterations)
    none = PatchIndex(torch.zeros(0, 1, dtype=torch.int64), torch.zeros(0, 1, dtype=torch.bool))
    targets = CofinetTargets(
        coarse=want["synth.gt_matching_mask"],
        drawn=torch.zeros(0, 2),
        patches=(none, none),
        fine=want["synth.gt_fine"],
    )
    losses = cofinet_losses(coarse, fine, targets, config.loss)
    losses.total.backward()  # type: ignore[no-untyped-call]
    found = {
        f"synth.out.{name}": (apart(value, want[f"synth.out.{name}"]), LOSS)
        for name, value in named_parts(losses).items()
    }
    for name, key in (("coarse.in", "coarse_in"), ("coarse.bin_score", "bin_score"), ("fine.in", "fine_in")):
        gradient = inputs[name].grad
        assert gradient is not None
        found[f"synth.grad_{key}"] = (apart(gradient, want[f"synth.grad_{key}"]), LOSS)
    return found
