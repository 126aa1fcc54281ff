# SPDX-License-Identifier: MIT
"""Random choice among a few items: as `Generator.choice`, in a tenth of its time."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def one(rng: np.random.Generator, things: Sequence[T], shares: tuple[float, ...] | None = None) -> T:
    """One of `things`, with probabilities `shares` (uniform where there are none)."""
    if shares is None:
        return things[int(rng.integers(len(things)))]
    return things[bisect_right(_steps(shares), rng.random())]


@lru_cache(maxsize=64)
def _steps(shares: tuple[float, ...]) -> list[float]:
    sums = np.cumsum(shares)
    return [float(s) for s in sums / sums[-1]]
