# SPDX-License-Identifier: MIT
"""A set of matches around each seed, halved until it is small, and the pose that it gives (HCF)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.hcf.compatibility import Floats, Rows, leading_eigenvectors
from hybridreg.geometry.kabsch import kabsch_batch

Array = NDArray[np.float64]

_EPS = 1e-6
_CHUNK_VALUES = 1 << 22
# Size of a set where there are fewer matches in all than wanted; such sets are not halved.
_SMALL = 4


class Filtered(NamedTuple):
    """Sets after one halving, and the number of compatible members by which each member was chosen."""

    sets: Rows  # (S, k)
    scores: NDArray[np.int64]  # (S, k)


def first_sets(agreement: Floats, size: int) -> Rows:
    """The ``size`` matches (S, size) most compatible with each seed, from (S, K); 4 where there are fewer."""
    size = size if agreement.shape[1] >= size else min(_SMALL, agreement.shape[1])
    # Integers sort by counting; the first of equals comes first.
    short = agreement.max(initial=0.0) < np.iinfo(np.int16).max
    return np.argsort((-agreement).astype(np.int16 if short else np.int32), axis=1, kind="stable")[:, :size]


def filter_sets(soft: Floats, sets: Rows, share: float, final: int) -> list[Filtered]:
    """Halve sets (S, k) until they have at most ``final`` members: 200, 100, 50, 25, 12 as published for 15.

    A member is ranked by the number of members compatible with it and with the set's *first* member, usually the seed;
    the two themselves need not be compatible (module/HCF_module.py, corr_filter).
    """
    steps: list[Filtered] = []
    while sets.shape[1] > final and sets.shape[1] > _SMALL:
        found = _halved(soft, sets, max(1, int(share * sets.shape[1])))
        steps.append(found)
        sets = found.sets
    return steps


def _halved(soft: Floats, sets: Rows, left: int) -> Filtered:
    k = sets.shape[1]
    step = max(1, _CHUNK_VALUES // (k * k))
    parts, scores = [], []
    for start in range(0, len(sets), step):
        block = sets[start : start + step]
        agree = (soft[block[:, :, None], block[:, None, :]] > 0.0).astype(np.float32)
        score = (agree[:, :1] @ agree)[:, 0].astype(np.int32)
        order = np.argsort(-score, axis=1, kind="stable")[:, :left]
        parts.append(np.take_along_axis(block, order, axis=1))
        scores.append(np.take_along_axis(score, order, axis=1).astype(np.int64))
    return Filtered(np.concatenate(parts), np.concatenate(scores))


def set_weights(soft: Floats, sets: Rows, iterations: int) -> tuple[Floats, int]:
    """Weights (S, k) of the members with sum one: the leading eigenvector of their compatibility without the
    diagonal."""
    matrices = soft[sets[:, :, None], sets[:, None, :]].copy()
    diagonal = np.arange(sets.shape[1])
    matrices[:, diagonal, diagonal] = 0.0
    weights, done = leading_eigenvectors(matrices, iterations)
    return weights / (weights.sum(axis=1, keepdims=True) + np.float32(_EPS)), done


def set_poses(source: Array, target: Array, sets: Rows, weights: Floats) -> Array:
    """Poses (S, 4, 4) by weighted least squares; the identity where a set has no weight."""
    return kabsch_batch(source[sets], target[sets], weights.astype(np.float64)).T
