# SPDX-License-Identifier: MIT
"""Which frames of a drive become pairs."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WINDOW = 100  # frames ahead that are considered


def kitti_pairs(positions: Array, distance: float = 10.0) -> list[tuple[int, int]]:
    """The usual pairs of a KITTI sequence: each frame with the last one before the distance exceeds `distance`.

    The rule of D3Feat, which Predator, CoFiNet and GeoTransformer share: among the next 100 frames the first
    farther than `distance` is j; the pair is (i, j - 1), and the next pair starts at j.

    Parameters
    ----------
    positions : (N, 3)
        Row k is where frame k was taken, metres.
    """
    pairs, i = [], 0
    while i < len(positions):
        beyond = np.flatnonzero(_distances(positions, positions[i], i) > distance)
        if len(beyond) == 0:
            i += 1
            continue
        partner = i + int(beyond[0]) - 1
        if partner > i:  # a jump of more than the distance between two frames leaves a frame alone
            pairs.append((i, partner))
        i = partner + 1
    return pairs


def pairs_across(
    source: Array, target: Array, sources: Collection[int], targets: Collection[int], min_dist: float
) -> list[tuple[int, int]]:
    """Pairs of two sensors on one drive: frame i with the first j >= i at least `min_dist` away.

    Parameters
    ----------
    source, target : (N, 3), (M, 3)
        Where each sensor's frames were taken, in one world frame, metres.
    sources, targets : collections of int
        Frames with a cloud.
    min_dist : float
        Metres; 0 pairs each frame with the other sensor's frame of the same number.
    """
    pairs, start = [], 0
    there = set(targets)
    for i in sorted(n for n in sources if n < len(source)):
        if i < start:
            continue
        ahead = i + np.flatnonzero(_distances(target, source[i], i) >= min_dist)
        partner = next((int(j) for j in ahead if int(j) in there), None)
        if partner is not None:
            pairs.append((i, partner))
            start = max(partner, i + 1)
    return pairs


def _distances(positions: Array, place: Array, start: int) -> Array:
    return np.linalg.norm(positions[start : start + WINDOW] - place, axis=1)
