# SPDX-License-Identifier: MIT
"""What the recordings of networks in folders of their own have in common: reading, and differences of arrays."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn


def read_plan(stem: Path) -> dict[str, Any]:
    """The configuration of a recording."""
    plan: dict[str, Any] = json.loads(stem.with_name(f"{stem.name}.json").read_text())
    return plan


def read_values(stem: Path) -> tuple[dict[str, Tensor], list[str]]:
    """Recorded tensors by name, and the names of the parameters whose gradient norms were recorded."""
    with np.load(stem.with_name(f"{stem.name}.npz")) as arrays:
        names = [str(name) for name in arrays["train.grad_names"]]
        numbers = [name for name in arrays.files if arrays[name].dtype.kind != "U"]
        return {name: torch.from_numpy(np.array(arrays[name])) for name in numbers}, names


def read_weights(stem: Path) -> dict[str, Tensor]:
    """The state dict by the original's names."""
    with np.load(stem.with_name(f"{stem.name}_weights.npz")) as arrays:
        return {name.removeprefix("w."): torch.from_numpy(np.array(arrays[name])) for name in arrays.files}


def apart(value: Tensor, want: Tensor) -> float:
    """Largest absolute difference; infinite where the shapes differ or a number is not finite."""
    if value.shape != want.shape:
        return math.inf
    difference = (value.detach().double() - want.double()).abs()
    return float(difference.nan_to_num(nan=math.inf).max()) if value.numel() else 0.0


def unequal(value: Tensor, want: Tensor) -> float:
    """How many of two arrays of whole numbers differ; infinite where the shapes do."""
    if value.shape != want.shape:
        return math.inf
    return float((value.long() != want.long()).sum())


def relative(value: Tensor, want: Tensor) -> float:
    """Largest difference as a share of the largest recorded value."""
    return apart(value, want) / max(float(want.abs().max()), 1e-12)


def held(
    ours: Mapping[str, Tensor],
    want: Mapping[str, Tensor],
    prefix: str,
    tolerance: float = 1e-4,
    axes: Mapping[str, int] | None = None,
) -> dict[str, tuple[float, float]]:
    """Our tensors, by the names that follow the prefix, against those of them that were recorded.

    A recorded name that ends in ``_firstN`` has the first N rows, or the first N along the axis of a name's ending.
    Whole numbers must be equal.
    """
    found = {}
    for key in want:
        name, first, count = key.removeprefix(prefix).rpartition("_first")
        name = name if first else count
        if key.startswith(prefix) and name in ours:
            axis = next((axis for end, axis in (axes or {}).items() if name.endswith(f"_{end}")), 0)
            value = (
                ours[name].narrow(axis, 0, min(int(count), ours[name].shape[axis])) if first else ours[name]
            )
            whole = not want[key].is_floating_point()
            found[key] = (unequal(value, want[key]), 0.0) if whole else (apart(value, want[key]), tolerance)
    return found


def gradients(
    network: nn.Module, names: Mapping[str, str], want: Mapping[str, Tensor], recorded: list[str]
) -> dict[str, tuple[float, float]]:
    """Gradient norms of the recorded parameters, and single gradients, against the recording.

    ``names`` has our name for each of the original's. A bias before a batch normalisation has no gradient but rounding:
    norms are held against their own size or a ten-thousandth of the largest, whichever is larger. Of recorded kernels
    with many offsets, only the first and the middle one may be there.
    """
    ours = dict(network.named_parameters())
    norms = torch.tensor([float(_gradient(ours[names[name]]).double().norm()) for name in recorded])
    norms, expected = norms.double(), want["train.grad_norms"].double()
    floor = 1e-4 * float(expected.max())
    found = {"train.grad_norms": (float(((norms - expected).abs() / expected.clamp_min(floor)).max()), 1e-3)}
    for key in want:
        if key.startswith("train.grad."):
            gradient = _gradient(ours[names[key.removeprefix("train.grad.")]])
            if gradient.shape != want[key].shape and len(want[key]) == 2:
                gradient = gradient[[0, len(gradient) // 2]]
            found[key] = (relative(gradient, want[key]), 1e-3)
    return found


def _gradient(parameter: nn.Parameter) -> Tensor:
    return torch.zeros_like(parameter) if parameter.grad is None else parameter.grad


def statistics(
    network: nn.Module, names: Mapping[str, str], want: Mapping[str, Tensor]
) -> dict[str, tuple[float, float]]:
    """Running statistics after a training step's forward passes."""
    state = network.state_dict()
    keys = [key for key in want if key.startswith("train.after.")]
    return {key: (apart(state[names[key.removeprefix("train.after.")]], want[key]), 1e-4) for key in keys}


def complete(
    found: dict[str, tuple[float, float]], want: Mapping[str, Tensor], inputs: set[str]
) -> dict[str, tuple[float, float]]:
    """With an infinite difference for every recorded output that nobody compared."""
    missed = {key: (math.inf, 0.0) for key in want if key not in found and key not in inputs}
    return {**found, **missed}
