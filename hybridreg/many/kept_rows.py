# SPDX-License-Identifier: MIT
"""What a run that was cut off left on disk: rows below a header of the settings that they were made with."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from hybridreg.config.changed_settings import differences
from hybridreg.io.line_file import cut, whole_lines

Value = TypeVar("Value")


def kept(path: Path, settings: Mapping[str, Any], parse: Callable[[list[Any]], Value]) -> Value | None:
    """`parse` of the complete rows of a file, whose last, partial line is cut off; None where there is no file, or no
    complete line in it.

    Raises
    ------
    ValueError
        The file is damaged (also where `parse` raises ValueError, TypeError or KeyError), or was made with other
        settings.
    """
    if not path.is_file():
        return None
    try:
        lines, length = whole_lines(path)
        if not lines:
            return None
        header, *rows = (json.loads(line) for line in lines)
        found = parse(rows)
    except (ValueError, TypeError, KeyError) as error:
        raise ValueError(f"{path}: damaged ({error}); pass overwrite=True to make it anew") from error
    if changed := "; ".join(differences(header, json.loads(json.dumps(settings)))):
        raise ValueError(
            f"{path}: was made with other settings ({changed}); pass overwrite=True to make it anew, or write to "
            "another path"
        )
    cut(path, length)
    return found


def looks(file: str) -> str:
    """A file by its name, size and time, by which one that has changed since is told."""
    told = os.stat(file)
    return f"{file}, {told.st_size} bytes, {told.st_mtime_ns} ns"
