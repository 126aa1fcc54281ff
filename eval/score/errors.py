# SPDX-License-Identifier: MIT
"""Errors of every row against the truth, and which rows succeed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.eval.run.row import Row
from hybridreg.eval.score import metrics
from hybridreg.eval.score.protocols import Protocol

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Step = Literal["refined", "estimated"]


@dataclass(frozen=True, eq=False)
class Errors:
    """Errors of n rows.

    Attributes
    ----------
    rre_deg, rte_m, rmse_m : (n,)
        NaN where the pair has no truth because it could not be read.
    failed : (n,) bool
        No pose was found. Such a row is scored with the identity and never succeeds.
    """

    rre_deg: Array
    rte_m: Array
    rmse_m: Array
    failed: Bools

    def __len__(self) -> int:
        return len(self.failed)

    def success(self, protocol: Protocol) -> Bools:
        """Which rows the protocol calls a success, (n,)."""
        if protocol.rmse_m is not None:
            return ~self.failed & (self.rmse_m < protocol.rmse_m)
        return self.within(protocol.rre_deg, protocol.rte_m)

    def within(self, rre_deg: float, rte_m: float) -> Bools:
        """Which rows have both errors strictly below the thresholds, (n,)."""
        return ~self.failed & (self.rre_deg < rre_deg) & (self.rte_m < rte_m)


def of(rows: Sequence[Row], step: Step = "refined") -> Errors:
    """Errors of rows, after refinement or of the estimate before it."""
    # A method may have returned absurd numbers: its errors are then infinite, or NaN, and it does not succeed.
    with np.errstate(over="ignore", invalid="ignore"):
        measured = np.array([_errors(row, step) for row in rows], dtype=np.float64).reshape(-1, 4)
    return Errors(measured[:, 0], measured[:, 1], measured[:, 2], measured[:, 3] > 0.0)


def _errors(row: Row, step: Step) -> tuple[float, float, float, bool]:
    found = row.T if step == "refined" else row.T_estimated
    failed = found is None or row.error is not None
    if row.T_true is None:
        return np.nan, np.nan, np.nan, True
    T = np.eye(4) if failed else np.array(found)
    truth = np.array(row.T_true)
    rmse = (
        np.nan if row.moments is None or not row.overlap else metrics.rmse_m(T, truth, np.array(row.moments))
    )
    return metrics.rre_deg(T, truth), metrics.rte_m(T, truth), rmse, failed
