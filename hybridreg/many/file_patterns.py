# SPDX-License-Identifier: MIT
"""Files of clouds by their paths or by patterns such as `scans/*.pcd`."""

from __future__ import annotations

import glob
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any


def is_pattern(text: str) -> bool:
    """Whether a text is a pattern, and no file of that name, brackets and all."""
    return glob.has_magic(text) and not os.path.exists(text)


def files_named(what: Sequence[str]) -> list[str]:
    """Paths in the order given; of each pattern the files, and those folders that are ROS 2 bags, in the order of their
    names, in which 2 stands before 10.

    Raises
    ------
    FileNotFoundError
        No file fits a pattern.
    ValueError
        A folder of clouds.
    """
    files: list[str] = []
    for each in what:
        if _is_mere_folder(each):
            raise ValueError(f"{each}: is a folder; give a pattern of its files, '{os.path.join(each, '*')}'")
        found = [each]
        if not os.path.exists(each):
            fitting = sorted(glob.glob(each, recursive=True), key=_by_number)
            found = [file for file in fitting if not _is_mere_folder(file)]
        if not found:
            raise FileNotFoundError(
                f"{each}: no file fits this {'pattern' if is_pattern(each) else 'name'} "
                f"(the current folder is {Path.cwd()})"
            )
        files += found
    return files


def _is_mere_folder(file: str) -> bool:
    return os.path.isdir(file) and not os.path.isfile(os.path.join(file, "metadata.yaml"))


def _by_number(name: str) -> list[Any]:
    return [int(part) if part.isdigit() else part for part in re.split(r"([0-9]+)", name)]
