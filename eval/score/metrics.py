# SPDX-License-Identifier: MIT
"""Measures of one pair: errors of a pose, a set of matches or a mask against the ground truth (docs/methods.md 1.2,
1.3)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]


def rre_deg(T: Array, truth: Array) -> float:
    """Relative rotation error, degrees in [0, 180]: the angle of `R^T R_true`."""
    return se3.angle_deg(T[:3, :3].T @ truth[:3, :3])


def rte_m(T: Array, truth: Array) -> float:
    """Relative translation error `|t - t_true|`, metres, of two 4x4 poses.

    Both must be poses between the raw sensor frames: centring the clouds would change the number.
    """
    return float(np.linalg.norm(T[:3, 3] - truth[:3, 3]))


def inlier_ratio(source: Array, target: Array, truth: Array, radius: float) -> float:
    """Share of matches, rows of `source` and `target` (K, 3), that the true pose brings within `radius` metres.

    Strictly within; 0 where there are no matches.
    """
    if len(source) == 0:
        return 0.0
    return float(np.mean(match_residuals(source, target, truth) < radius))


def match_residuals(source: Array, target: Array, truth: Array) -> Array:
    """Residuals (K,) in metres of the matches under the true pose."""
    residuals: Array = np.linalg.norm(se3.apply(truth, source) - target, axis=1)
    return residuals


def second_moments(points: Array) -> Array:
    """Mean of `p p^T` over homogeneous points (N, 3) -> (4, 4): all that `rmse_m` needs of them."""
    homogeneous = np.column_stack([points, np.ones(len(points))])
    moments: Array = homogeneous.T @ homogeneous / max(len(points), 1)
    return moments


def rmse_m(T: Array, truth: Array, moments: Array) -> float:
    """Root mean square of `|T p - T_true p|` over the points behind `moments` (4, 4), metres.

    With the points of the true overlap this is the registration RMSE of the 3DMatch benchmark; the quadratic
    form `tr(D M D^T)`, `D = T - T_true`, allows computing it after the points are gone.
    """
    difference = (T - truth)[:3]
    return float(np.sqrt(max(np.trace(difference @ moments @ difference.T), 0.0)))


class MaskScores(NamedTuple):
    """Agreement of a predicted mask with the true one; a ratio without a denominator is 0."""

    precision: float
    recall: float
    f1: float
    iou: float


def mask_scores(predicted: Bools, truth: Bools) -> MaskScores:
    """Precision, recall, F1 and intersection over union of two masks (n,)."""
    hit = float(np.sum(predicted & truth))
    n_predicted, n_true = float(predicted.sum()), float(truth.sum())
    return MaskScores(
        precision=_ratio(hit, n_predicted),
        recall=_ratio(hit, n_true),
        f1=_ratio(2.0 * hit, n_predicted + n_true),
        iou=_ratio(hit, n_predicted + n_true - hit),
    )


def _ratio(part: float, whole: float) -> float:
    return part / whole if whole else 0.0
