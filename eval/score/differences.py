# SPDX-License-Identifier: MIT
"""Whether one method is better than another: paired differences on the same pairs, with an interval."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.eval.report.table_columns import Cells, number
from hybridreg.eval.run.row import Row
from hybridreg.eval.score import bootstrap, errors
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.score.scoring import inlier_ratios, scene_of

Array = NDArray[np.float64]


class Difference(NamedTuple):
    """Mean of one method's measure minus the other's, and its bootstrap 95 % interval over scenes."""

    mean: float
    low: float
    high: float


def difference(ours: Array, theirs: Array, scenes: Sequence[str]) -> Difference:
    """Difference of a measure of the same pairs, (n,) each; NaN where one side has no such measure."""
    if not (len(ours) and len(theirs)):
        return Difference(float("nan"), float("nan"), float("nan"))
    apart = ours - theirs
    return Difference(float(apart.mean()), *bootstrap.interval(apart, scenes))


def cells(name: str, rows: Sequence[Row], first: Sequence[Row], protocol: Protocol) -> Cells:
    """A row of differences to the first method, percentage points, over pairs that both could read."""
    theirs = {row.id: row for row in first if row.T_true is not None}
    mine = [row for row in rows if row.id in theirs and row.T_true is not None]
    other = [theirs[row.id] for row in mine]
    scenes = [scene_of(row) for row in mine]
    recall = difference(_successes(mine, protocol), _successes(other, protocol), scenes)
    inliers = difference(inlier_ratios(mine, protocol), inlier_ratios(other, protocol), scenes)
    return {
        "method": name,
        "recall %": number(100.0 * recall.mean, 1),
        "recall, 95 % interval": _interval(recall),
        "inliers %": number(100.0 * inliers.mean, 1),
        "inliers, 95 % interval": _interval(inliers),
    }


def _successes(rows: Sequence[Row], protocol: Protocol) -> Array:
    return errors.of(rows).success(protocol).astype(np.float64)


def _interval(found: Difference) -> str:
    return f"{number(100.0 * found.low, 1)} to {number(100.0 * found.high, 1)}"
