# SPDX-License-Identifier: MIT
"""Poses of upright clouds by votes: each pair of similar points votes for the shift that it asks for under every yaw.

A Hough transform (Ballard, Pattern Recognition 1981) over yaw and horizontal shift. It finds the pose where hardly one
pair in fifty is right, since the wrong ones vote for shifts all over the plane. Both z axes must point the same way;
some degrees between them move a vote by less than a cell.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.learned.matching.similar_points import SimilarPoints

Array = NDArray[np.float64]

_YAWS = np.arange(
    0.0, 360.0, 3.0
)  # degrees; with 2 between them no better, with 4 worse; `sim:val`, 150 pairs
# How far from the usual one the difference of two points' heights may be, spacings; 1.2 as good on `sim:val`.
_BAND = 2.0
_PEAKS = 3  # of one yaw; by hand
# Shifts of more spacings, from middle to middle, get no votes: a stray point would ask for gigabytes of cells.
_FARTHEST = 400
# Two peaks nearer to each other than both are one, spacings and degrees; by hand.
_APART, _TURNED = 2.5, 8.0


def upright_poses(pairs: SimilarPoints, spacing: float, most: int) -> Array:
    """At most ``most`` poses (p, 4, 4) with the most votes, best first.

    Parameters
    ----------
    pairs : SimilarPoints
    spacing : float
        Typical distance of the points, metres: the side of a cell.
    most : int
    """
    if not len(pairs.weight):
        return np.empty((0, 4, 4))
    rise = pairs.target[:, 2] - pairs.source[:, 2]
    height = _usual(rise, pairs.weight, spacing)
    level = np.abs(rise - height) < _BAND * spacing
    source, target, weight = pairs.source[level], pairs.target[level], pairs.weight[level]
    middle, there = np.median(source, axis=0), np.median(target, axis=0)
    arms = (source - middle)[:, :2] / spacing, (target - there)[:, :2] / spacing
    peaks = np.concatenate([_peaks(yaw, *arms, weight) for yaw in _YAWS])
    chosen: list[Array] = []
    for peak in peaks[np.argsort(-peaks[:, 0], kind="stable")]:
        if all(_differ(peak, other) for other in chosen):
            chosen.append(peak)
        if len(chosen) == most:
            break
    moved = there - middle
    poses = [
        se3.about(
            middle,
            se3.yaw(yaw)[:3, :3],
            np.array([moved[0] + spacing * x, moved[1] + spacing * y, height]),
        )
        for _, yaw, x, y in chosen
    ]
    return np.array(poses).reshape(-1, 4, 4)


def _usual(rise: Array, weight: Array, spacing: float) -> float:
    # The middle of the two neighbouring bins, half a spacing each, that hold the most.
    bins, at = np.unique(np.floor(rise / (0.5 * spacing)), return_inverse=True)
    held = np.bincount(at, weight)
    following = np.append(np.where(np.diff(bins) == 1.0, held[1:], 0.0), 0.0)
    return float((bins[np.argmax(held + following)] + 1.0) * 0.5 * spacing)


def _peaks(yaw: float, source: Array, target: Array, weight: Array) -> Array:
    # Rows of votes, yaw and shift of the best corners of cells; what four cells that meet there hold is its votes.
    cosine, sine = np.cos(np.radians(yaw)), np.sin(np.radians(yaw))
    shift = target - source @ np.array([[cosine, sine], [-sine, cosine]])
    reach = min(int(np.abs(shift).max()) + 2, _FARTHEST)
    cell = np.floor(shift).astype(np.int64) + reach
    side = 2 * reach
    inside = ((cell >= 0) & (cell < side)).all(axis=1)
    row, column = cell[inside].T
    held = np.bincount(row * side + column, weight[inside], side * side).reshape(side, side)
    votes = held[:-1, :-1] + held[1:, :-1] + held[:-1, 1:] + held[1:, 1:]
    best = np.argpartition(-votes, _PEAKS, axis=None)[:_PEAKS]
    row, column = np.divmod(best, side - 1)
    corner = np.stack([row, column], axis=1) + 1 - reach
    return np.column_stack([votes[row, column], np.full(len(best), yaw), corner])


def _differ(one: Array, other: Array) -> bool:
    turn = abs((one[1] - other[1] + 180.0) % 360.0 - 180.0)
    return bool(turn > _TURNED or np.linalg.norm(one[2:] - other[2:]) > _APART)
