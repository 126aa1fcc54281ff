# SPDX-License-Identifier: MIT
"""Weights that come with the package: which there are, found without torch."""

from __future__ import annotations

import os
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

from hybridreg.io.structured import read_json

CONFIG_FILE = "config.json"
WEIGHTS_FILE = "model.safetensors"
CARD_FILE = "card.json"


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


def visits(name: str | os.PathLike[str]) -> int | None:
    """Training pairs that weights have seen, repeats counted, with all that they began with; None if no card says so.

    Raises
    ------
    ValueError
        The card beside the weights is damaged.
    """
    folder = find(name)
    if folder is None or not (folder / CARD_FILE).is_file():
        return None
    card = read_json(folder / CARD_FILE)
    told = card.get("visits") if isinstance(card, dict) else None
    return told if isinstance(told, int) else None


def visits_of(method: Any) -> int | None:
    """Of the weights of a pipeline, or of a control of one: the most, where its stages differ; None without any."""
    pipeline = getattr(method, "pipeline", method)
    slots = (getattr(pipeline, slot, None) for slot in ("overlap", "match", "estimate"))
    found = [visits(name) for name in map(_weights_of, slots) if name]
    return max((each for each in found if each is not None), default=None)


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
        name = next(iter(missing.values()))
        where = "a folder that is not there"
        if len(Path(name).parts) == 1:
            where = f"which do not come with this version (shipped: {', '.join(names()) or 'none'})"
        raise MissingWeights(
            f"{what} needs the weights {name!r}, {where}; train some with `hybridreg train` and name their folder: "
            f"{options}"
        )


def _weights_of(stage: Any) -> str | None:
    found = stage.get("weights") if isinstance(stage, Mapping) else getattr(stage, "weights", None)
    return found if isinstance(found, str) else None


def _folder() -> Path:
    return Path(str(files("hybridreg.learned"))) / "weights"
