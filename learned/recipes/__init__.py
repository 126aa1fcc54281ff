# SPDX-License-Identifier: MIT
"""Training recipes by name: TOML files next to this one."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def names() -> list[str]:
    """Names that `hybridreg train` takes."""
    return sorted(f.name.removesuffix(".toml") for f in files(__name__).iterdir() if f.name.endswith(".toml"))


def find(name: str) -> Path:
    """The file of a name, or of a path.

    Raises
    ------
    FileNotFoundError
        Neither exists.
    """
    for file in (Path(name), Path(str(files(__name__).joinpath(f"{name}.toml")))):
        if file.is_file():
            return file
    raise FileNotFoundError(
        f"{name}: no such file, and no recipe of that name; known are {', '.join(names())}"
    )
