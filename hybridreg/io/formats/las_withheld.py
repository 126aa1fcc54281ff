# SPDX-License-Identifier: MIT
"""Points of a LAS file that were deleted without being taken out: their flag `withheld`."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def without_withheld(points: Array, withheld: Any, name: str) -> Array:
    """The points (N, 3) that are not flagged in `withheld`, (N,) or None where a record has no such flag.

    Source: ASPRS, LAS Specification 1.4-R15, table 8: such a point "should not be included in processing".
    """
    flags = np.zeros(len(points), dtype=bool) if withheld is None else np.asarray(withheld, dtype=bool)
    if not flags.any():
        return points
    warnings.warn(
        f"{name}: {int(flags.sum())} of {len(flags)} points are flagged as withheld, which means deleted; they were "
        "left out",
        UserWarning,
        stacklevel=3,
    )
    return points[~flags]
