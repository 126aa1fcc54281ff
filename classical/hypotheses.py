# SPDX-License-Identifier: MIT
"""Poses from small random samples of matches."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.kabsch import STATUSES, kabsch_batch

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def draw(n_samples: int, size: int, weight: Array, rng: np.random.Generator) -> Indices:
    """Rows of matches (n_samples, size), by weight; uniform where all weights are equal."""
    if weight.max() == weight.min():
        return rng.integers(0, len(weight), (n_samples, size))
    cumulative = np.cumsum(weight)
    # Rounding may carry a draw past the last row.
    rows = np.searchsorted(cumulative, rng.random((n_samples, size)) * cumulative[-1], side="right")
    return np.minimum(rows, len(weight) - 1)


def rigid(samples: Indices, source: Array, target: Array, edge_ratio: float, shortest: float) -> Indices:
    """Samples whose edges have the same length in source and target.

    Edges are checked one after another, each only for the samples that passed so far: nine samples in ten fail at the
    first, so that few poses are computed.

    Parameters
    ----------
    edge_ratio : float in [0, 1]
        Shorter edge over longer edge must reach this.
    shortest : float
        Metres; an edge no longer than this says nothing about the rotation. This also drops a match drawn twice.
    """
    for i, j in combinations(range(samples.shape[1]), 2):
        one = _square(source[samples[:, i]] - source[samples[:, j]])
        two = _square(target[samples[:, i]] - target[samples[:, j]])
        low, high = np.minimum(one, two), np.maximum(one, two)
        samples = samples[(low >= edge_ratio**2 * high) & (low > shortest**2)]
    return samples


def poses(samples: Indices, source: Array, target: Array, max_distance: float) -> Array:
    """Poses (b, 4, 4) of the samples whose matches all agree with the pose fitted to them."""
    p, q = source[samples], target[samples]
    fits = kabsch_batch(p, q)
    residual = np.einsum("bij,bkj->bki", fits.T[:, :3, :3], p) + fits.T[:, None, :3, 3] - q
    agree = (_square(residual) < max_distance**2).all(axis=1)
    return fits.T[agree & (fits.status == STATUSES.index("ok"))]


def _square(vectors: Array) -> Array:
    return np.einsum("...i,...i->...", vectors, vectors)
