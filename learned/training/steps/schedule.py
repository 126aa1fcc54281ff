# SPDX-License-Identifier: MIT
"""Optimiser and learning rate of a phase. The rate is a function of the step, so resuming needs no state."""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import nn

from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.training.recipe import Phase


def steps_of(phase: Phase, pairs: int, batch: int) -> int:
    """Optimiser steps of a phase over ``pairs`` training pairs, ``batch`` of them a step."""
    return phase.steps or max(1, math.ceil(phase.epochs * pairs / batch))


def rate_at(phase: Phase, step: int, steps: int) -> float:
    """Learning rate of step ``step`` (from 0) of ``steps``."""
    if step < phase.warmup:
        return phase.rate * (step + 1) / phase.warmup
    if phase.decay == "linear":
        return phase.rate * (steps - step) / max(1, steps - phase.warmup)
    if phase.decay == "step":
        every = phase.decay_every if phase.steps else phase.decay_every * steps / phase.epochs
        return phase.rate * phase.decay_factor ** (step // max(1.0, every))
    return phase.rate


def make_optimizer(phase: Phase, network: Pretrained) -> torch.optim.Optimizer:
    """The phase's optimiser: the backbone's parameters with a factor on their rate, or frozen at factor 0.

    Raises
    ------
    ValueError
        A factor for the backbone of a network that has none.
    """
    part = getattr(network, "backbone", None)
    if part is None and phase.backbone_rate != 1.0:
        raise ValueError(
            f"phase {phase.name!r}: backbone_rate={phase.backbone_rate}, but {network.name} has no backbone"
        )
    backbone = [] if part is None else list(part.parameters())
    known = {id(parameter) for parameter in backbone}
    others = [parameter for parameter in network.parameters() if id(parameter) not in known]
    for parameter in backbone:
        parameter.requires_grad_(phase.backbone_rate > 0)
    groups = [{"params": others, "factor": 1.0}]
    if backbone and phase.backbone_rate > 0:
        groups.append({"params": backbone, "factor": phase.backbone_rate})
    how: dict[str, Any] = {"lr": phase.rate, "weight_decay": phase.weight_decay}
    if phase.optimizer == "sgd":
        # Not fused: that raises where a parameter's first gradient comes after those of others (torch 2.13), as those
        # of the image's parts may.
        return torch.optim.SGD(groups, momentum=phase.momentum, foreach=True, **how)
    make = torch.optim.AdamW if phase.optimizer == "adamw" else torch.optim.Adam
    # One pass over each tensor: a fifth of the time of the plain loop on the CPU.
    return make(groups, fused=True, **how)


def set_rate(optimizer: torch.optim.Optimizer, rate: float) -> None:
    """Set the rate of every group, times its factor."""
    for group in optimizer.param_groups:
        group["lr"] = rate * group["factor"]


def trainable(optimizer: torch.optim.Optimizer) -> list[nn.Parameter]:
    """All parameters that an optimiser moves."""
    return [parameter for group in optimizer.param_groups for parameter in group["params"]]
