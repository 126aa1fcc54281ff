# SPDX-License-Identifier: MIT
"""Points of a LAS file that were deleted without being taken out: their flag `withheld`."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault

Array = NDArray[np.float64]

_COLUMN = "withheld_flag"


def without_withheld(points: Array, withheld: Any, name: str) -> Array:
    """The points (N, 3) that are not flagged in `withheld`, (N,) or None where a record has no such flag.

    Source: ASPRS, LAS Specification 1.4-R15, table 8: such a point "should not be included in processing".

    Raises
    ------
    ValueError
        Another number of flags than of points: of a reader that some points were taken from before.
    """
    flags = np.zeros(len(points), dtype=bool) if withheld is None else np.asarray(withheld, dtype=bool)
    if len(flags) != len(points):
        cure = "open the file anew, or give its path"
        raise fault(name, f"its reader stands before the last {len(points)} of {len(flags)} points", cure)
    if not flags.any():
        return points
    warnings.warn(
        f"{name}: {int(flags.sum())} of {len(flags)} points are flagged as withheld, which means deleted; they were "
        "left out",
        UserWarning,
        stacklevel=3,
    )
    return points[~flags]


def flags_withheld(x: Any) -> Any:
    """The flags of a LAS cloud of another library: its `withheld`, as laspy's, or those of its points one by one, as
    copclib 2.6.3 has them; or the column that lazpy 0.9.2's readers decode; None where it has none."""
    flags = getattr(x, "withheld", None)
    if flags is not None:
        return None if callable(flags) else flags
    if callable(getattr(x, "arrays", None)) and hasattr(x, "point_format"):
        return x.arrays(_COLUMN, start=0)[_COLUMN]
    if hasattr(x, "point_format_id") and hasattr(x, "__getitem__") and len(x) and hasattr(x[0], "withheld"):
        return [each.withheld for each in x]
    return None
