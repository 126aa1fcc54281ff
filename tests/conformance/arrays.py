# SPDX-License-Identifier: MIT
"""What all recordings have in common: how they are read, differences of arrays, and that no output is left out."""

from __future__ import annotations

import json
import math
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

# Difference and tolerance by recorded output.
Found = dict[str, tuple[float, float]]


def read_plan(stem: Path) -> dict[str, Any]:
    """The configuration of a recording."""
    plan: dict[str, Any] = json.loads(stem.with_name(f"{stem.name}.json").read_text())
    return plan


def read_arrays(path: Path) -> dict[str, Tensor]:
    """Arrays of numbers of a file by name; whole numbers as int64 and masks as they are."""
    with np.load(path) as arrays:
        found = {
            name: torch.from_numpy(np.array(arrays[name]))
            for name in arrays.files
            if arrays[name].dtype.kind != "U"
        }
    return {name: t.long() if t.dtype in (torch.int16, torch.int32) else t for name, t in found.items()}


def read_values(stem: Path) -> tuple[dict[str, Tensor], list[str]]:
    """Recorded tensors by name, and the names of the parameters whose gradient norms were recorded."""
    path = stem.with_name(f"{stem.name}.npz")
    with np.load(path) as arrays:
        names = [str(name) for name in arrays["train.grad_names"]]
    return read_arrays(path), names


def read_weights(stem: Path) -> dict[str, Tensor]:
    """The state dict by the original's names."""
    found = read_arrays(stem.with_name(f"{stem.name}_weights.npz"))
    return {name.removeprefix("w."): tensor for name, tensor in found.items()}


def apart(value: Tensor, want: Tensor) -> float:
    """Largest absolute difference; infinite where the shapes differ, or where one is not finite and the other is."""
    if value.shape != want.shape:
        return math.inf
    if not value.numel():
        return 0.0
    value, want = value.detach().double(), want.double()
    same = (value == want) | (value.isnan() & want.isnan())
    return float(torch.where(same, 0.0, (value - want).abs().nan_to_num(nan=math.inf)).max())


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
) -> Found:
    """Our tensors, by the names that follow the prefix, against those of them that were recorded.

    A recorded name that ends in ``_firstN`` has the first N rows, or the first N along the axis of a name's ending.
    Axes of length one may be missing. Whole numbers must be equal.
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
            value, expected = value.squeeze(), want[key].squeeze()
            whole = not expected.is_floating_point()
            found[key] = (unequal(value, expected), 0.0) if whole else (apart(value, expected), tolerance)
    return found


def gradients(
    network: nn.Module, names: Mapping[str, str], want: Mapping[str, Tensor], recorded: list[str]
) -> Found:
    """Gradient norms of the recorded parameters, and single gradients, against the recording.

    ``names`` has our name for each of the original's. A bias before a batch normalisation has no gradient but rounding:
    norms are held against their own size or a thousandth of the largest, whichever is larger. Of recorded kernels
    with many offsets, only the first and the middle one may be there.
    """
    ours = dict(network.named_parameters())
    norms = torch.tensor([float(_gradient(ours[names[name]]).double().norm()) for name in recorded])
    norms, expected = norms.double(), want["train.grad_norms"].double()
    floor = 1e-3 * float(expected.max())
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


def statistics(network: nn.Module, names: Mapping[str, str], want: Mapping[str, Tensor]) -> Found:
    """Running statistics after a training step's forward passes."""
    state = network.state_dict()
    keys = [key for key in want if key.startswith("train.after.")]
    return {key: (apart(state[names[key.removeprefix("train.after.")]], want[key]), 1e-4) for key in keys}


def complete(found: Found, want: Mapping[str, Tensor], inputs: Collection[str]) -> Found:
    """With an infinite difference for every recorded output that nobody compared.

    ``inputs`` holds names of what is none, or beginnings of such names, with a dot at their end.
    """
    beginnings = tuple(each for each in inputs if each.endswith("."))
    left = (key for key in want if key not in found and key not in inputs and not key.startswith(beginnings))
    return {**found, **dict.fromkeys(sorted(left), (math.inf, 0.0))}
