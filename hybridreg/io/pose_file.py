# SPDX-License-Identifier: MIT
"""Reading a pose that a person or this library wrote down."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, shorten
from hybridreg.io.structured import read_json
from hybridreg.io.whole_files import read_whole

# What the field, the library's own results among them, calls a pose in JSON.
_KEYS = ("T_target_source", "transformation")


def read_pose(path: str | os.PathLike[str]) -> NDArray[np.float64]:
    """Sixteen (or twelve) numbers as a matrix (4, 4): text, or JSON of such or of a `result.json`.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        Other text, or another count of numbers.
    """
    name = os.fspath(path)
    values: Any
    if name.lower().endswith(".json"):
        values = read_json(path)
        if isinstance(values, dict):
            values = next((values[key] for key in _KEYS if key in values), values)
    else:
        values = read_whole(Path(path)).decode("utf-8", "replace").replace(",", " ").split()
    try:
        numbers = np.array(values, dtype=np.float64).ravel()
    except (TypeError, ValueError) as error:
        raise fault(
            name, f"holds no matrix ({shorten(error)})", "write a pose as four lines of four numbers"
        ) from error
    if numbers.size not in (12, 16):
        raise fault(name, f"holds {numbers.size} numbers", "a pose has sixteen, four a line")
    T = np.eye(4)
    T.flat[: numbers.size] = numbers
    return T
