# SPDX-License-Identifier: MIT
"""Validation of networks with their own examples: their stage in a pipeline, without refinement."""

from __future__ import annotations

import tempfile
from typing import Any

import numpy as np
import torch

from hybridreg import registry
from hybridreg.classical.sampling import AllPoints
from hybridreg.classical.voxel import VoxelGrid
from hybridreg.eval.run.row import Row, matrix
from hybridreg.eval.score import metrics
from hybridreg.eval.score.protocols import Protocol
from hybridreg.frames import lower_pose
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.stages.network_stage import NetworkStage
from hybridreg.learned.stages.networks import forget
from hybridreg.pair import LabelledPair
from hybridreg.pipeline import Pipeline

# Slots in which a network's stage is searched: a matcher or an estimator before an overlap stage.
_SLOTS = ("match", "estimate")


def estimator_of(name: str) -> str:
    """The estimator with which a network is validated."""
    slot, stage = _stage_of(name)
    if slot == "estimate":
        return registry.name_of(stage(untrained=True)) or stage.__name__
    return "estimate.lgr" if "group" in stage.gives else "estimate.ransac"


def rows_of(
    network: Pretrained, pairs: list[tuple[str, LabelledPair]], device: torch.device, protocol: Protocol
) -> list[Row]:
    """Rows for the evaluator, of pairs by name.

    The weights are written to and read from a folder, like a user's. A pair that its pipeline refuses counts as not
    registered.
    """
    matches = _stage_of(network.name)[0] == "match"
    with tempfile.TemporaryDirectory() as folder:
        network.save_pretrained(folder)
        pipeline = _pipeline(network, folder, str(device))
        rows = [
            _row(pipeline, number, name, pair, protocol if matches else None)
            for number, (name, pair) in enumerate(pairs)
        ]
    forget()
    return rows


def _pipeline(network: Pretrained, folder: str, device: str) -> Pipeline:
    slot, cls = _stage_of(network.name)
    stage = cls(weights=folder, device=device, untrained=True, **network.validated_with)
    grid: Any = AllPoints() if network.voxel is None else VoxelGrid(voxel=network.voxel)
    if slot == "estimate":
        return Pipeline(downsample=grid, match="none", estimate=stage, refine="none")
    estimate = estimator_of(network.name).partition(".")[2]
    return Pipeline(downsample=grid, match=stage, estimate=estimate, refine="none")


def _stage_of(name: str) -> tuple[str, type[NetworkStage]]:
    for slot in _SLOTS:
        for key in registry.BUILT_IN:
            at, _, stage = key.partition(".")
            if at != slot:
                continue
            cls = registry.load(at, stage)
            if issubclass(cls, NetworkStage) and cls.kind == name:
                return slot, cls
    raise KeyError(f"no stage runs the network {name!r}")


def _row(
    pipeline: Pipeline, number: int, name: str, labelled: LabelledPair, protocol: Protocol | None
) -> Row:
    truth = lower_pose(labelled.T_target_source, labelled.pair)
    try:
        trace = pipeline.trace(labelled.pair)
    except ValueError:  # clouds that no pose can be computed from
        return Row(index=number, id=name, T=None, T_true=matrix(truth), n_matches=0, inlier_ratio={})
    trace.scene.release()
    source, target = np.asarray(trace.matches.source), np.asarray(trace.matches.target)
    ratios = {}
    if protocol is not None:  # an estimator that uses only the clouds has no matches to evaluate
        ratios[f"{protocol.inlier_m:g}"] = metrics.inlier_ratio(source, target, truth, protocol.inlier_m)
    return Row(
        index=number,
        id=name,
        T=matrix(trace.refined.T) if trace.refined.found else None,
        T_true=matrix(truth),
        n_matches=len(source),
        inlier_ratio=ratios,
    )
