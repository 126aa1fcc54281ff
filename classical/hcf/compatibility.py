# SPDX-License-Identifier: MIT
"""Compatibility of matches: a rigid motion preserves the distances between points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import cdist

Array = NDArray[np.float64]
Floats = NDArray[np.float32]
Rows = NDArray[np.int64]

_BLOCK_VALUES = 1 << 22
_EPS = 1e-6
# The published iteration stops by torch.allclose.
_RELATIVE = 1e-5  # its rtol
_ABSOLUTE = 1e-8  # its atol; no unit


class Seeds(NamedTuple):
    """Matches around which sets are collected."""

    rows: Rows  # (S,) best first
    is_peak: NDArray[np.bool_]  # (K,) whose confidence no match nearby exceeds


def first_order(source: Array, target: Array, reach: float) -> Floats:
    """``[1 - (|p_i - p_j| - |q_i - q_j|)^2 / reach^2]+`` (K, K) for matches p, q (K, 3) in metres; diagonal 1."""
    out = np.empty((len(source), len(source)), dtype=np.float32)
    for rows in _blocks(len(source)):
        change = cdist(source[rows], source) - cdist(target[rows], target)
        out[rows] = np.maximum(1.0 - (change / reach) ** 2, 0.0)
    return out


def leading_eigenvectors(matrices: Floats, iterations: int) -> tuple[Floats, int]:
    """Power iteration from ones: (B, k, k) to (B, k) of length one, and the number of multiplications.

    It stops for the whole batch at once, when none changes any more (module/HCF_module.py,
    cal_leading_eigenvector).
    """
    vectors = np.ones((*matrices.shape[:2], 1), dtype=np.float32)
    for done in range(1, iterations + 1):
        before, vectors = vectors, matrices @ vectors
        vectors = vectors / (np.linalg.norm(vectors, axis=1, keepdims=True) + np.float32(_EPS))
        if np.allclose(vectors, before, rtol=_RELATIVE, atol=_ABSOLUTE):
            return vectors[..., 0], done
    return vectors[..., 0], iterations


def pick_seeds(source: Array, confidence: Floats, radius: float, count: int) -> Seeds:
    """The ``count`` most confident peaks among matches (K,), ``radius`` metres apart in the source (K, 3).

    Matches of equal confidence are all peaks. Where there are fewer peaks than requested, other matches follow in
    order.
    """
    peak = np.ones(len(source), dtype=bool)
    for rows in _blocks(len(source)):
        near = cdist(source[rows], source) < radius
        peak[rows] = ~(near & (confidence[None] > confidence[rows, None])).any(axis=1)
    order = np.argsort(-(confidence * peak), kind="stable")
    return Seeds(order[:count], peak)


def second_order(soft: Floats, seeds: Rows) -> Floats:
    """Number of matches compatible with both a seed (S,) and each match: (S, K) integers; 0 where these two are not.

    Compatibility with both is required at half the tolerance of ``soft`` (K, K), that of the two at the full tolerance
    (Chen et al., CVPR 2022, equation 5, in VRHCF's form with two thresholds).
    """
    at_half = np.float32(0.75)  # 1 - (1/2)^2
    tight = (soft[seeds] > at_half).astype(np.float32)
    out = np.empty((len(seeds), len(soft)), dtype=np.float32)
    for columns in _blocks(len(soft)):
        out[:, columns] = tight @ (soft[:, columns] > at_half).astype(np.float32)
    out[soft[seeds] <= 0.0] = 0.0
    return out


def _blocks(n: int) -> list[slice]:
    step = max(1, _BLOCK_VALUES // max(n, 1))
    return [slice(start, min(start + step, n)) for start in range(0, n, step)]
