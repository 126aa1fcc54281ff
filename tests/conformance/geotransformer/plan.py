# SPDX-License-Identifier: MIT
"""A recording: the network's configuration from its JSON, batch and expected values from its arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
from arrays import read_arrays, read_plan, read_weights
from torch import Tensor

from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.cross3dreg.config import (
    BackboneConfig,
    LgrConfig,
    LossConfig,
    MatchingConfig,
    NetworkConfig,
    TransformerConfig,
)
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.pyramid.point_pyramid import Pyramid
from hybridreg.learned.weights import load_official_tensors


@dataclass(frozen=True)
class Recording:
    """Everything recorded about one network on one pair."""

    config: NetworkConfig
    network: RegistrationNetwork
    batch: Batch
    values: dict[str, Tensor]


def read_recording(stem: Path) -> Recording:
    """Read ``STEM.json``, ``STEM.npz`` and ``STEM_weights.npz`` and build the network from the JSON alone."""
    plan, values = read_plan(stem), read_arrays(stem.with_name(f"{stem.name}.npz"))
    config = network_config(plan)
    network = RegistrationNetwork(config)
    load_official_tensors(network, read_weights(stem), stem.name)
    return Recording(config, network.eval(), _batch(values, config.backbone.stages), values)


def network_config(plan: Mapping[str, Any]) -> NetworkConfig:
    """Our configuration of a recorded plan."""
    transformer, fine = plan["transformer"], plan["fine"]
    backbone = BackboneConfig(
        stages=plan["stages"],
        voxel=plan["voxel"],
        base_radius=plan["base_radius"],
        base_sigma=plan["base_sigma"],
        neighbor_limits=tuple(plan["neighbor_limits"]),
        init_dim=plan["init_dim"],
        groups=plan["group_norm"],
        fine_dim=plan["fine_dim"],
        fine_stage=plan.get("fine_stage", 2),
    )
    if transformer["input_dim"] != backbone.coarse_dim:
        raise ValueError(f"input_dim {transformer['input_dim']} is not the backbone's {backbone.coarse_dim}")
    return NetworkConfig(
        backbone=backbone,
        transformer=TransformerConfig(
            hidden_dim=transformer["hidden_dim"],
            output_dim=transformer["output_dim"],
            heads=transformer["heads"],
            blocks=tuple(transformer["blocks"]),
            sigma_d=transformer["sigma_d"],
            sigma_a=transformer["sigma_a"],
            angle_k=transformer["angle_k"],
        ),
        matching=MatchingConfig(
            superpoint_matches=plan["superpoint_correspondences"],
            dual_normalization=plan.get("dual_normalization", True),
            matching_radius=plan["matching_radius"],
            patch_points=plan["points_in_patch"],
            sinkhorn_iterations=plan["sinkhorn_iterations"],
            topk=fine["topk"],
            mutual=fine["mutual"],
            confidence=fine["confidence_threshold"],
        ),
        lgr=LgrConfig(
            acceptance_radius=fine["acceptance_radius"],
            min_group=fine["correspondence_threshold"],
            steps=fine["refinement_steps"],
        ),
        loss=LossConfig(**plan["coarse_loss"], positive_radius=plan["fine_loss"]["positive_radius"]),
    )


def _batch(values: Mapping[str, Tensor], stages: int) -> Batch:
    def stack(name: str, count: int) -> tuple[Tensor, ...]:
        return tuple(values[f"in.{name}.{stage}"] for stage in range(count))

    lengths = [tuple(length.tolist()) for length in stack("lengths", stages)]
    pyramid = Pyramid(
        points=stack("points", stages),
        lengths=tuple((first, second) for first, second in lengths),
        neighbors=tuple(index.long() for index in stack("neighbors", stages)),
        subsampling=tuple(index.long() for index in stack("subsampling", stages - 1)),
        upsampling=tuple(index[:, 0].long() for index in stack("upsampling", stages - 1)),
    )
    return Batch(pyramid=pyramid, features=torch.ones(len(pyramid.points[0]), 1))
