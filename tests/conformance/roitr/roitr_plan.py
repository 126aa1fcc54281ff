# SPDX-License-Identifier: MIT
"""A recording of RoITr: configuration and network from its JSON, the levels from its arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from arrays import read_arrays, read_plan, read_weights
from torch import Tensor

from hybridreg.learned.cross3dreg.config import LossConfig, MatchingConfig, TransformerConfig
from hybridreg.learned.roitr.batch import RoitrBatch
from hybridreg.learned.roitr.config import RoitrConfig
from hybridreg.learned.roitr.network import RoitrNetwork
from hybridreg.learned.roitr.official_names import official_name, unused_names
from hybridreg.learned.roitr.point_levels import Levels
from hybridreg.learned.weights import load_official_tensors

SIDES = ("src", "tgt")


@dataclass(frozen=True)
class RoitrRecording:
    """Everything recorded about one network on one pair."""

    plan: dict[str, Any]
    config: RoitrConfig
    network: RoitrNetwork
    batch: RoitrBatch
    values: dict[str, Tensor]

    def levels(self, side: str) -> Levels:
        """The recorded levels of a cloud, ``src`` or ``tgt``."""
        return self.batch.source if side == "src" else self.batch.target


def read_recording(stem: Path) -> RoitrRecording:
    """Read the three files and build the network from the JSON alone."""
    plan, values = read_plan(stem), read_arrays(stem.with_name(f"{stem.name}.npz"))
    config = network_config(plan)
    network = RoitrNetwork(config)
    unused = unused_names(network.state_dict())
    load_official_tensors(network, read_weights(stem), stem.name, official_name, unused)
    batch = RoitrBatch(source=_levels(values, "src", config), target=_levels(values, "tgt", config))
    return RoitrRecording(plan, config, network.eval(), batch, values)


def network_config(plan: Mapping[str, Any]) -> RoitrConfig:
    """Our configuration of a recorded plan."""
    transformer, fine, coarse = plan["transformer"], plan["fine"], plan["coarse_matching"]
    loss = {name: value for name, value in plan["coarse_loss"].items() if name != "weight"}
    wanted = [name for name in ("use_dustbin", "use_global_score") if fine.get(name)]
    if wanted or not plan["neighbors_exclude_self"]:
        raise ValueError(f"no published RoITr has {wanted or 'points among their own neighbours'}")
    dual = "dual" in coarse["kind"]
    return RoitrConfig(
        coarse="dual" if dual else "adaptive",
        widths=tuple(plan["widths"]),
        hidden=tuple(plan["local_hidden"]),
        blocks=tuple(plan["blocks_per_level"]),
        strides=tuple(plan["strides"]),
        neighbors=tuple(plan["neighbors"]),
        heads=plan["heads"],
        decoder_heads=plan["decoder_heads"],
        interpolation=plan["interpolation_neighbors"],
        normal_neighbors=plan["normals"]["knn"],
        fine_dim=plan["fine_dim"],
        transformer=TransformerConfig(
            hidden_dim=transformer["width"],
            output_dim=plan["coarse_dim"],
            heads=transformer["heads"],
            blocks=tuple(transformer["blocks"]),
            sigma_d=transformer["sigma_d"],
            sigma_a=transformer["sigma_a"],
            angle_k=transformer["angle_k"],
        ),
        matching=MatchingConfig(
            superpoint_matches=coarse.get("superpoint_correspondences", plan["adaptive_matching"]["minimum"]),
            matching_radius=plan["matching_radius"],
            patch_points=plan["points_in_patch"],
            sinkhorn_iterations=plan["sinkhorn_iterations"],
            topk=fine["topk"],
            mutual=fine["mutual"],
            confidence=fine["confidence_threshold"],
        ),
        loss=LossConfig(
            **loss,
            targets=plan["training"]["gt_correspondences"],
            positive_radius=plan["fine_loss"]["positive_radius"],
        ),
        coarse_weight=plan["coarse_loss"]["weight"],
        fine_weight=plan["fine_loss"]["weight"],
        target_overlap=plan["training"]["overlap_threshold"],
        max_feature_distance=plan["adaptive_matching"]["similarity_threshold"],
        occlusion_radius=plan["occlusion_radius"],
    )


def _levels(values: Mapping[str, Tensor], side: str, config: RoitrConfig) -> Levels:
    count = config.levels
    points, normals = [values[f"in.{side}_points"]], [values[f"in.{side}_normals"]]
    picked = [values[f"in.{side}.fps.{level}"] for level in range(2, count + 1)]
    for rows in picked:
        points.append(points[-1][rows])
        normals.append(normals[-1][rows])
    return Levels(
        points=tuple(points),
        normals=tuple(normals),
        neighbors=tuple(values[f"in.{side}.knn.{level}"] for level in range(1, count + 1)),
        picked=tuple(picked),
        down=tuple(values[f"in.{side}.down_knn.{level}"] for level in range(2, count + 1)),
        up=tuple(values[f"in.{side}.up_knn.{level}"] for level in range(1, count)),
        up_distance=tuple(values[f"in.{side}.up_dist.{level}"] for level in range(1, count)),
    )
