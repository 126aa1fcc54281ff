# SPDX-License-Identifier: MIT
"""Weighted random sampling without replacement."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def draw(weight: NDArray[np.float64], count: int, seed: int) -> NDArray[np.int64]:
    """At most ``count`` rows of positive weight (n,), ascending, sampled with probabilities proportional to their
    weights.

    All of them where there are no more than ``count`` (Efraimidis and Spirakis 2006: the smallest of exponential
    variables with the weights for rates).
    """
    rows = np.flatnonzero(weight > 0.0)
    if len(rows) <= count:
        return rows
    waiting = np.random.default_rng(seed).exponential(size=len(rows)) / weight[rows]
    return np.sort(rows[np.argpartition(waiting, count - 1)[:count]])
