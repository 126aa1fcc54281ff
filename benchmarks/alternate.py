# SPDX-License-Identifier: MIT
"""Time rivals in turn, so that a slow minute of the machine hits all of them alike."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from hybridreg.data import open_dataset
from hybridreg.pair import LabelledPair


def seconds(rivals: dict[str, Callable[[], Any]], rounds: int = 5) -> dict[str, float]:
    """Median wall time of each rival over `rounds` turns, after one turn that warms up caches and imports."""
    times: dict[str, list[float]] = {name: [] for name in rivals}
    for turn in range(rounds + 1):
        for name, run in rivals.items():
            start = time.perf_counter()
            run()
            if turn:
                times[name].append(time.perf_counter() - start)
    return {name: float(np.median(taken)) for name, taken in times.items()}


def real_pairs(folder: str, wanted: list[str]) -> list[LabelledPair]:
    """Pairs of a folder by name, or all; none, with a message, where the folder is absent."""
    if not Path(folder).is_dir():
        print(f"no real pairs at {folder}: nothing to measure (pass --data)")
        return []
    return [labelled for labelled in open_dataset(folder) if not wanted or labelled.pair.id in wanted]
