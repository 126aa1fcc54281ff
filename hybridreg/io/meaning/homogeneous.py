# SPDX-License-Identifier: MIT
"""Homogeneous points that are still to be divided by their fourth number, as triangulation gives them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault
from hybridreg.io.meaning.first_column import FEWEST, looked_at

_SAME = 1e-4  # of the length 1, as far as text rounds it


def refuse_homogeneous(rows: NDArray[Any], name: str, cure: str) -> None:
    """Refuse a table (N, 4) whose rows all have the length 1: OpenCV's `triangulatePoints` (5.0) gives points so,
    and quaternions are so; no points and intensities are. `cure` says how to divide them.

    Raises
    ------
    ValueError
        They have.
    """
    if rows.shape[1] != 4 or len(rows) < FEWEST:
        return
    with np.errstate(over="ignore", invalid="ignore"):
        some = np.asarray(np.ma.filled(rows[looked_at(len(rows))].astype(np.float64), np.nan))
    some = some[np.isfinite(some).all(axis=1)]
    # A missing return or a lone axis has that length too; a fourth number that is 0 or 1 is no divisor.
    if len(some) < FEWEST or np.isin(some[:, 3], (0.0, 1.0)).any():
        return
    if (np.abs(np.linalg.norm(some, axis=1) - 1.0) < _SAME).all():
        problem = "its rows of four numbers all have the length 1, as homogeneous points and quaternions do"
        raise fault(name, problem, f"if they are points, divide them by the fourth: {cure}")
