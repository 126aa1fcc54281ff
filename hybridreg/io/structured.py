# SPDX-License-Identifier: MIT
"""TOML and JSON from any source: what cannot be parsed raises one `ValueError` that names it, whatever the parser
raises."""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

from hybridreg.io.whole_files import read_whole

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib


def parse_toml(text: str, name: str) -> dict[str, Any]:
    """The tables of a TOML text that messages call `name`.

    Raises
    ------
    ValueError
        Not TOML, nested too deeply, or with a number of thousands of digits.
    """
    try:
        return tomllib.loads(text)
    # TOMLDecodeError is a ValueError, as is what Python raises for endless digits.
    except (ValueError, RecursionError) as error:
        raise _unreadable(name, "TOML", error) from error


def read_toml(path: str | os.PathLike[str]) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        A folder, or as `parse_toml`.
    """
    return parse_toml(_text(path, "TOML"), os.fspath(path))


def parse_json(text: str, name: str) -> Any:
    """The value of a JSON text that messages call `name`.

    Raises
    ------
    ValueError
        Not JSON, nested too deeply, or with a number of thousands of digits.
    """
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise _unreadable(name, "JSON", error) from error


def read_json(path: str | os.PathLike[str]) -> Any:
    """The value in a JSON file.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        A folder, or as `parse_json`.
    """
    return parse_json(_text(path, "JSON"), os.fspath(path))


def _text(path: str | os.PathLike[str], kind: str) -> str:
    try:
        return read_whole(Path(path)).decode("utf-8")
    except (UnicodeDecodeError, IsADirectoryError) as error:
        raise _unreadable(os.fspath(path), kind, error) from error


def _unreadable(name: str, kind: str, error: Exception) -> ValueError:
    return ValueError(f"{name}: not a {kind} file ({error})")
