# SPDX-License-Identifier: MIT
"""Pipelines by name: TOML files next to this one, in the format that `Pipeline.save` writes."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path
from typing import Any

from hybridreg.config.near_name import did_you_mean
from hybridreg.slots import SLOTS

DEFAULT = "default"


def names() -> list[str]:
    """Names that `Pipeline.preset` takes."""
    return sorted(f.name.removesuffix(".toml") for f in files(__name__).iterdir() if f.name.endswith(".toml"))


def load(name: str) -> dict[str, Any]:
    """Slots of a preset, as tables.

    Raises
    ------
    KeyError
        A name that does not exist; it lists those that do.
    """
    if name not in names():
        hint = did_you_mean(str(name), names()) or "."
        raise KeyError(f"no preset is called {name!r}{hint} Known: {', '.join(names())}")
    from hybridreg.io.structured import parse_toml

    text = files(__name__).joinpath(f"{name}.toml").read_text(encoding="utf-8")
    return _slots(parse_toml(text, name), name)


def read(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Slots of a pipeline file, as tables.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        Not TOML, or a table that is not a slot.
    """
    from hybridreg.io.structured import read_toml

    return _slots(read_toml(path), os.fspath(path))


# Endings that promise another format.
_NO_TOML = (".json", ".yaml", ".yml", ".ini", ".cfg", ".xml", ".pkl", ".pickle", ".joblib")


def write(path: str | os.PathLike[str], slots: dict[str, Any]) -> None:
    """Write slots as TOML, whole or not at all."""
    if Path(path).suffix.lower() in _NO_TOML:
        raise ValueError(f"{os.fspath(path)}: a pipeline is written as TOML; end the name in .toml")
    import tomli_w

    from hybridreg.io.atomic import atomic_path

    for slot, table in slots.items():
        if ":" in table.get("stage", ""):
            raise ValueError(
                f"{slot}: {table['stage']} is not registered, so a file could not name it; register it through the "
                "entry-point group 'hybridreg.stages'"
            )
    with atomic_path(path) as temporary:
        Path(temporary).write_text(tomli_w.dumps(slots), encoding="utf-8")


def _slots(tables: dict[str, Any], origin: str) -> dict[str, Any]:
    unknown = set(tables) - {*SLOTS, "voxel", "prior"}
    if unknown:
        raise ValueError(
            f"{origin}: {', '.join(sorted(unknown))} is not a slot; the slots are {', '.join(SLOTS)}"
        )
    return tables
