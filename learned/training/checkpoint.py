# SPDX-License-Identifier: MIT
"""Checkpoints of a training run: written whole, read safely."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import torch

from hybridreg import __version__
from hybridreg.io.atomic import write_bytes
from hybridreg.io.formats.torch_file import parse_torch
from hybridreg.io.whole_files import read_whole

_FORMAT = 1


@dataclass(kw_only=True)
class Progress:
    """Progress of a run. Together with the seed it determines all that follows: every sample has its own random
    generator, made from the seed and its number, so that no generator's state has to be stored."""

    phase: int = 0
    step: int = 0  # finished optimiser steps of the phase
    total: int = 0  # of all phases
    visits: int = 0  # pairs shown so far, skipped steps counted
    skipped: dict[str, int] = field(default_factory=dict)  # steps skipped, by pair
    seconds: float = 0.0  # of training, over all runs
    best: tuple[float, ...] = ()  # rank of the best validation
    best_total: int = 0  # and the step it was made at
    window: dict[str, list[float]] = field(default_factory=dict)  # sums since the last line of the log


def save(
    path: Path,
    progress: Progress,
    network: torch.nn.Module,
    optimizer: torch.optim.Optimizer | None,
    recipe: dict[str, Any],
    data: Mapping[str, str] | None = None,
) -> None:
    """Write a checkpoint, whole or not at all; `data` identifies the content of each source, so that a change is
    detected.

    Raises
    ------
    OSError
        A full disk, a folder that cannot be written to; it names `path`.
    """
    content = {
        "format": _FORMAT,
        "version": __version__,
        "recipe": recipe,
        "progress": asdict(progress),
        "network": network.state_dict(),
        "optimizer": None if optimizer is None else optimizer.state_dict(),
        "data": dict(data or {}),
    }
    # Through memory: on a full disk torch's own writer names neither the reason nor the file.
    stored = io.BytesIO()
    torch.save(content, stored)
    write_bytes(path, stored.getvalue())


def load(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The content of a checkpoint, with its progress as `Progress`.

    Raises
    ------
    FileNotFoundError
        There is none.
    ValueError
        The file is damaged or of another format.
    """
    if not Path(path).is_file():
        raise FileNotFoundError(f"{os.fspath(path)}: there is no checkpoint to resume from")
    content: dict[str, Any] = parse_torch(read_whole(Path(path)), os.fspath(path))
    if not isinstance(content, dict) or "format" not in content:
        raise ValueError(f"{os.fspath(path)}: is damaged, or not a checkpoint of a training run")
    if content["format"] != _FORMAT:
        raise ValueError(f"{os.fspath(path)}: a checkpoint of format {content.get('format')}, not {_FORMAT}")
    content["progress"] = Progress(**content["progress"])
    return content
