# SPDX-License-Identifier: MIT
"""Checkpoints as published by the authors of networks, read without running any code in them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from torch import Tensor

from hybridreg.io.formats.torch_file import parse_torch
from hybridreg.io.whole_files import read_whole

_ENDINGS = (".tar", ".pth", ".pt", ".pkl")
# Keys under which a published file may have its tensors, if not at the top level.
_KEYS = ("state_dict", "model")


@dataclass(frozen=True)
class Checkpoint:
    """A published checkpoint: its tensors, and the settings that it was trained with, where the file has them."""

    tensors: dict[str, Tensor]
    settings: Mapping[str, Any] = field(default_factory=dict)

    def number(self, name: str) -> float | None:
        """A positive number among the settings."""
        value = self.settings.get(name)
        is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and value > 0
        return float(value) if is_number else None  # type: ignore[arg-type]


def is_checkpoint(weights: str) -> bool:
    """Whether a name is that of a published checkpoint and not of a folder."""
    return weights.endswith(_ENDINGS)


def read_checkpoint(path: str | os.PathLike[str]) -> Checkpoint:
    """Read a checkpoint with ``weights_only``: a bare state dict, or one under ``state_dict`` or ``model``.

    The prefix ``module.`` of parallel training is removed.

    Raises
    ------
    FileNotFoundError
        No such file.
    ValueError
        Damaged, with contents other than tensors and plain values, or without a state dict.
    """
    file = Path(path)
    if not file.is_file():
        raise FileNotFoundError(f"no checkpoint {os.fspath(path)!r}")
    content = parse_torch(read_whole(file), str(file))
    content = content if isinstance(content, dict) else {}
    state = next((content[key] for key in _KEYS if isinstance(content.get(key), dict)), content)
    if not state or not all(isinstance(value, Tensor) for value in state.values()):
        raise ValueError(
            f"{file} holds no state dict, neither at the top nor under {' or '.join(map(repr, _KEYS))}"
        )
    settings = content.get("config")
    return Checkpoint(
        {name.removeprefix("module."): tensor for name, tensor in state.items()},
        settings if isinstance(settings, Mapping) else {},
    )
