# SPDX-License-Identifier: MIT
"""Recordings of our own networks on stacked clouds, as those of the originals are: the source first."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from streets import moved, street, yaw
from torch import Tensor, nn

from hybridreg.learned.cross3dreg.batch import Batch, make_batch
from hybridreg.learned.matching.procrustes import apply_transform
from hybridreg.learned.pyramid.point_pyramid import Pyramid

TRUTH = yaw(40.0, (1.0, 0.0, 0.0))


def backbone_plan(architecture: list[str], width: int, kernel_points: int, voxel: float) -> dict[str, Any]:
    """What the plans of both networks have in common."""
    stages = 1 + sum(block.endswith("_strided") for block in architecture)
    return {
        "stages": stages,
        "voxel": voxel,
        "base_radius": 2.7,
        "base_sigma": 1.7,
        "kernel_points": kernel_points,
        "neighbor_limits": [9 + stage for stage in range(stages)],
        "input_dim": 1,
        "init_dim": width,
        "architecture": architecture,
    }


def made_batch(config: Any, points: int = 1500, extent: float = 12.0) -> Batch:
    """Two samplings of one street, the source in its own frame."""
    target = street(1, points, extent)
    source = moved(street(1, points, extent)[: points * 4 // 5], np.linalg.inv(TRUTH))
    return make_batch(target, source, config)


def inputs(pyramid: Pyramid, pairs: tuple[Tensor, Tensor]) -> dict[str, Tensor]:
    """The pyramid with the source first, the pose, and the true pairs of source and target points."""
    lengths = [(source, target) for target, source in pyramid.lengths]

    def rows(tensor: Tensor, stage: int) -> Tensor:
        return torch.cat([tensor[pyramid.lengths[stage][0] :], tensor[: pyramid.lengths[stage][0]]])

    def links(index: Tensor, at: int, to: int) -> Tensor:
        source, target = lengths[to]
        index = rows(index, at)
        out = torch.where(index < target, index + source, index - target)
        return torch.where(index < source + target, out, index).int()

    target, source = pyramid.clouds(0)
    found = {"in.src_points": source, "in.ref_points": target}
    found |= {
        "in.transform": torch.from_numpy(TRUTH).float(),
        "in.correspondences": torch.stack(pairs, 1).int(),
    }
    for stage in range(pyramid.stages):
        found[f"in.points.{stage}"] = rows(pyramid.points[stage], stage)
        found[f"in.lengths.{stage}"] = torch.tensor(lengths[stage], dtype=torch.int32)
        found[f"in.neighbors.{stage}"] = links(pyramid.neighbors[stage], stage, stage)
        if stage + 1 < pyramid.stages:
            found[f"in.subsampling.{stage}"] = links(pyramid.subsampling[stage], stage + 1, stage)
            found[f"in.upsampling.{stage}"] = links(pyramid.upsampling[stage][:, None], stage, stage + 1)
    return found


def true_points(batch: Batch) -> tuple[Tensor, Tensor]:
    """Source and target points in the target's frame."""
    target, source = batch.pyramid.clouds(0)
    return apply_transform(source, torch.from_numpy(TRUTH).float()), target


def unsettle(network: nn.Module) -> None:
    """Move every parameter, so that nothing is 0 or 1 as it was made."""
    with torch.no_grad():
        for parameter in network.parameters():
            parameter += 0.05 * torch.randn_like(parameter)


def gradients(
    network: nn.Module, naming: Callable[[str], str], recorded: list[str], prefix: str
) -> dict[str, Tensor]:
    """Norms of all gradients in an order, and one gradient of each kind."""
    named = {naming(name): parameter.grad for name, parameter in network.named_parameters()}
    norms = [torch.zeros(()) if named.get(name) is None else named[name].norm() for name in recorded]  # type: ignore[union-attr]
    some = [name for name in recorded[::7] if named.get(name) is not None]
    found = {f"{prefix}grad.{name}": named[name].clone() for name in some}  # type: ignore[union-attr]
    return found | {f"{prefix}grad_norm": torch.stack(norms)}


def write(
    stem: Path, plan: Mapping[str, Any], values: Mapping[str, Tensor], weights: Mapping[str, Tensor]
) -> None:
    """The three files of a recording; layers that are 1x1 convolutions in the originals are written as such."""
    stem.with_name(f"{stem.name}.json").write_text(json.dumps(plan))
    np.savez(
        stem.with_name(f"{stem.name}.npz"), **{name: value.detach().numpy() for name, value in values.items()}
    )
    np.savez(
        stem.with_name(f"{stem.name}_weights.npz"),
        **{f"w.{name}": as_convolution(name, tensor).detach().numpy() for name, tensor in weights.items()},
    )


def as_convolution(name: str, tensor: Tensor) -> Tensor:
    """A weight (C_out, C_in) outside of encoder and decoder blocks as (C_out, C_in, 1)."""
    return tensor[..., None] if tensor.dim() == 2 and "_blocks." not in name else tensor
