# SPDX-License-Identifier: MIT
"""Time competing methods alternately, so that a slow minute of the machine affects all of them alike."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hybridreg.data import open_dataset
from hybridreg.pair import LabelledPair


@dataclass
class Timed:
    """Best wall time of a method in seconds, and its result."""

    seconds: float
    result: Any


def race(rivals: dict[str, Callable[[], Any]], rounds: int = 5) -> dict[str, Timed]:
    """Let every method run `rounds` times, one after the other, after a round that warms up caches and imports.

    The best time of each counts: on a shared machine it is the best measure of the work itself.
    """
    timed = {name: Timed(float("inf"), run()) for name, run in rivals.items()}
    for _ in range(rounds):
        for name, run in rivals.items():
            start = time.perf_counter()
            run()
            timed[name].seconds = min(timed[name].seconds, time.perf_counter() - start)
    return timed


def real_pairs(folder: str, wanted: list[str]) -> list[LabelledPair]:
    """Pairs of a folder by name, or all; none, with a message, where the folder is absent."""
    if not Path(folder).is_dir():
        print(f"no real pairs at {folder}: nothing to measure (pass --data)")
        return []
    return [labelled for labelled in open_dataset(folder) if not wanted or labelled.pair.id in wanted]
