# SPDX-License-Identifier: MIT
"""Recordings of networks on stacked clouds (Predator, CoFiNet): they have the source first, we the target."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import torch
from arrays import Found, apart
from torch import Tensor, nn

from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.kpfcnn.kpfcnn import KpfcnnDecoder, KpfcnnEncoder
from hybridreg.learned.kpfcnn.kpfcnn_config import KpfcnnConfig
from hybridreg.learned.pyramid.point_pyramid import Pyramid

FEATURES, SHARE = 2e-4, 0.01
# A gradient that is nothing but rounding (of a bias before a normalisation) is held against this instead of itself.
_NO_GRADIENT = 1e-3
# A distance (m) this near to a radius falls on either side of it.
TIE = 1e-5


def backbone_config(plan: Mapping[str, Any]) -> KpfcnnConfig:
    """Encoder and decoder of a recorded plan."""
    if plan.get("input_dim", 1) != 1:
        raise ValueError(f"input_dim {plan['input_dim']}: these networks see a constant, one number a point")
    config = KpfcnnConfig(
        blocks=tuple(plan["architecture"]),
        voxel=plan["voxel"],
        base_radius=plan["base_radius"],
        base_sigma=plan["base_sigma"],
        neighbor_limits=tuple(plan["neighbor_limits"]),
        init_dim=plan["init_dim"],
        kernel_points=plan["kernel_points"],
    )
    if config.stages != plan["stages"]:
        raise ValueError(f"the architecture has {config.stages} stages, the plan says {plan['stages']}")
    return config


def exchanged(rows: Tensor, first: int) -> Tensor:
    """Rows of two stacked clouds in the other order; the first ``first`` rows go last."""
    return torch.cat([rows[first:], rows[:first]])


def read_batch(values: Mapping[str, Tensor], stages: int) -> Batch:
    """The recorded pyramid with the target first."""
    lengths = [tuple(values[f"in.lengths.{stage}"].tolist()) for stage in range(stages)]

    def links(name: str, at: int, to: int) -> Tensor:
        index = exchanged(values[f"in.{name}.{min(at, to)}"].long(), lengths[at][0])
        first, second = lengths[to]
        moved = torch.where(index < first, index + second, index - first)
        return torch.where(index < first + second, moved, index)

    pyramid = Pyramid(
        points=tuple(exchanged(values[f"in.points.{s}"], lengths[s][0]) for s in range(stages)),
        lengths=tuple((second, first) for first, second in lengths),
        neighbors=tuple(links("neighbors", s, s) for s in range(stages)),
        subsampling=tuple(links("subsampling", s + 1, s) for s in range(stages - 1)),
        upsampling=tuple(links("upsampling", s, s + 1)[:, 0] for s in range(stages - 1)),
    )
    return Batch(pyramid=pyramid, features=torch.ones(len(pyramid.points[0]), 1))


def recorded_order(rows: Tensor, pyramid: Pyramid, stage: int) -> Tensor:
    """Our rows of a stage with the source first."""
    return exchanged(rows, pyramid.lengths[stage][0])


class EncoderOutputs:
    """What each block of an encoder gives while this is open, by the originals' names and in their order."""

    def __init__(self, encoder: KpfcnnEncoder, pyramid: Pyramid) -> None:
        self.seen: dict[str, Tensor] = {}
        self._pyramid = pyramid
        self._hooks = []
        for index, (plan, block) in enumerate(zip(encoder.config.encoder(), encoder.blocks, strict=True)):
            before = plan.stage - plan.plan.strided
            parts = {"": (block, plan.stage), ".KPConv": (block.conv, plan.stage)}
            for ours, theirs, stage in (
                ("unary_in", "unary1", before),
                ("unary_out", "unary2", plan.stage),
                ("unary_shortcut", "unary_shortcut", plan.stage),
            ):
                parts[f".{theirs}"] = (getattr(block, ours, None), stage)
            for name, (module, stage) in parts.items():
                if module is not None:
                    self._hooks.append(self._watch(module, f"encoder_blocks.{index}{name}", stage))

    def _watch(self, module: nn.Module, name: str, stage: int) -> Any:
        def keep(_: nn.Module, __: Any, value: Tensor) -> None:
            self.seen[name] = recorded_order(value, self._pyramid, stage)

        return module.register_forward_hook(keep)

    def __enter__(self) -> dict[str, Tensor]:
        return self.seen

    def __exit__(self, *_: object) -> None:
        for hook in self._hooks:
            hook.remove()


def decoder_outputs(
    decoder: KpfcnnDecoder, features: Tensor, skips: list[Tensor], pyramid: Pyramid
) -> dict[str, Tensor]:
    """Output of each layer by the originals' names and in their order."""
    found, stage = {}, pyramid.stages - 1
    done = dict(decoder.steps(features, skips, pyramid))
    for index, block in enumerate(decoder.config.decoding):
        if block == "nearest_upsample":
            stage -= 1
        else:
            found[f"decoder_blocks.{index}"] = recorded_order(done[index], pyramid, stage)
    return found


def share_apart(value: Tensor, want: Tensor) -> float:
    """Largest difference as a share of each recorded value, or of 1e-3 where that is smaller."""
    if value.numel() != want.numel():
        return math.inf
    difference = (value.detach().reshape(-1).double() - want.reshape(-1).double()).abs()
    return float((difference / want.reshape(-1).double().abs().clamp_min(_NO_GRADIENT)).max())


def gradients_apart(
    network: nn.Module, names: Mapping[str, str], want: Mapping[str, Tensor], prefix: str
) -> Found:
    """Single gradients ``<prefix>grad.NAME`` against the recording: 1e-4, or 1 % where a convolution is passed.

    ``names`` has the original's name for each of ours.
    """
    ours = {names[name]: parameter.grad for name, parameter in network.named_parameters()}
    found: Found = {}
    for key, expected in want.items():
        if key.startswith(f"{prefix}grad."):
            name = key.removeprefix(f"{prefix}grad.")
            gradient = ours.get(name)
            if gradient is None:
                found[key] = (math.inf, 0.0)
            elif "encoder_blocks" in name:
                found[key] = (whole_share(gradient, expected), SHARE)
            else:
                found[key] = (apart(gradient.reshape(-1), expected.reshape(-1)), 1e-4)
    return found


def whole_share(value: Tensor, want: Tensor) -> float:
    """Largest difference as a share of the largest recorded value."""
    return apart(value.reshape(-1), want.reshape(-1)) / max(float(want.abs().max()), _NO_GRADIENT)


def norms_apart(
    network: nn.Module, names: Mapping[str, str], recorded: list[str], want: Tensor
) -> tuple[float, float]:
    """Norm of each parameter's gradient; a parameter that we have not, or without gradient, counts as 0."""
    ours = {names[name]: parameter.grad for name, parameter in network.named_parameters()}
    norms = [0.0 if ours.get(name) is None else float(ours[name].double().norm()) for name in recorded]  # type: ignore[union-attr]
    return share_apart(torch.tensor(norms), want), SHARE
