# SPDX-License-Identifier: MIT
"""Confidence intervals of means over few pairs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

N_RESAMPLES = 2000
# Above this many groups the draws are made in parts, to bound memory.
_CELLS = 20_000_000


def interval(
    values: Array, groups: Sequence[str], *, seed: int = 0, level: float = 0.95
) -> tuple[float, float]:
    """Percentile bootstrap interval of the mean of `values` (n,).

    Whole groups are drawn, because a pair and its random yaw rotations share a scene: drawn individually they would
    make the interval too narrow. Values that are not finite are left out.
    """
    keep = np.isfinite(values)
    if not keep.any():
        return float("nan"), float("nan")
    names, member = np.unique(np.asarray(groups)[keep], return_inverse=True)
    sums = np.bincount(member, weights=values[keep], minlength=len(names)).astype(np.float64)
    counts = np.bincount(member, minlength=len(names)).astype(np.float64)
    rng = np.random.default_rng(seed)
    part = max(1, _CELLS // len(names))
    means = np.concatenate(
        [_means(sums, counts, min(part, N_RESAMPLES - done), rng) for done in range(0, N_RESAMPLES, part)]
    )
    low, high = np.quantile(means, [0.5 - level / 2, 0.5 + level / 2])
    return float(low), float(high)


def _means(sums: Array, counts: Array, n: int, rng: np.random.Generator) -> Array:
    draw = rng.integers(len(sums), size=(n, len(sums)))
    means: Array = sums[draw].sum(axis=1) / counts[draw].sum(axis=1)
    return means
