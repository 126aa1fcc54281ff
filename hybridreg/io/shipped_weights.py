# SPDX-License-Identifier: MIT
"""Weights that come with the package: which there are, found without torch."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

CONFIG_FILE = "config.json"
WEIGHTS_FILE = "model.safetensors"


class MissingWeights(FileNotFoundError):
    """A pipeline names weights that are neither shipped nor a folder here."""


def names() -> list[str]:
    """Names of the weights that come with the package."""
    return sorted(
        file.parent.name for file in _folder().glob(f"*/{WEIGHTS_FILE}") if is_complete(file.parent)
    )


def find(name: str | os.PathLike[str]) -> Path | None:
    """The folder of a name, or of a path; None where neither holds weights."""
    return next((each for each in (Path(name), _folder() / os.fspath(name)) if is_complete(each)), None)


def is_complete(folder: Path) -> bool:
    """Are the weights and their configuration in a folder?"""
    return (folder / CONFIG_FILE).is_file() and (folder / WEIGHTS_FILE).is_file()


def require(slots: Mapping[str, Any], what: str) -> None:
    """Refuse stages, as tables or objects by slot, whose weights are not here.

    Raises
    ------
    MissingWeights
        It names them and says where to get weights.
    """
    named = {slot: _weights_of(stage) for slot, stage in slots.items()}
    missing = {
        slot: name for slot, name in named.items() if name and not Path(name).exists() and not find(name)
    }
    if missing:
        options = " ".join(f"--set {slot}.weights=FOLDER" for slot in missing)
        raise MissingWeights(
            f"{what} needs the weights {next(iter(missing.values()))!r}, which do not come with this version "
            f"(shipped: {', '.join(names()) or 'none'}); train some with `hybridreg train` and name their folder: "
            f"{options}"
        )


def _weights_of(stage: Any) -> str | None:
    found = stage.get("weights") if isinstance(stage, Mapping) else getattr(stage, "weights", None)
    return found if isinstance(found, str) else None


def _folder() -> Path:
    return Path(str(files("hybridreg.learned"))) / "weights"
