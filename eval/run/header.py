# SPDX-License-Identifier: MIT
"""The first line of a file of predictions, and which of its lines are whole."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hybridreg.config.plain_values import value_of
from hybridreg.io import line_file
from hybridreg.io.structured import parse_json

FORMAT = "hybridreg predictions 1"


def fingerprint_under(path: str | os.PathLike[str], seen: str) -> str | None:
    """The data's fingerprint in a file of predictions, where the data's files look the same as when it was written.

    None where they do not, or where there is no such file: the fingerprint must then be computed from the content.
    """
    try:
        with Path(path).open("rb") as file:
            header = header_of(file.readline().decode("utf-8"), path)
    except (OSError, ValueError):
        return None
    if not seen or header.get("seen") != seen:
        return None
    data = header["config"].get("data")
    found = data.get("fingerprint") if isinstance(data, Mapping) else None
    return found if isinstance(found, str) else None


def whole_lines(path: Path) -> tuple[list[str], int]:
    """The complete lines of a file, and their number of bytes.

    Raises
    ------
    ValueError
        Not text.
    """
    try:
        return line_file.whole_lines(path)
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not a file of predictions ({error})") from error


def refuse_foreign(path: Path) -> None:
    """Refuse a file without a complete line, unless it is the beginning of a header.

    Raises
    ------
    ValueError
        It is not.
    """
    begun = path.read_bytes()
    if not json.dumps({"format": FORMAT}).encode().startswith(begun[:20]):
        raise ValueError(f"{path}: not a file of predictions; write to another path")


def header_of(line: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """The first line: `config`, and perhaps `seen`.

    Raises
    ------
    ValueError
        It is not that of a file of predictions.
    """
    try:
        header = parse_json(line, os.fspath(path))
    except ValueError:
        header = None
    if not isinstance(header, dict) or header.get("format") != FORMAT:
        raise ValueError(f"{os.fspath(path)}: not a file of predictions; its first line is not {FORMAT!r}")
    value_of(Mapping[str, Any], header.get("config"), f"{os.fspath(path)}, line 1: config")
    return header
