# SPDX-License-Identifier: MIT
"""What is stored of one pair: everything that scoring needs, so that a run is done once and scored often."""

from __future__ import annotations

import json
import math
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.config.plain_values import build
from hybridreg.geometry import se3
from hybridreg.io.structured import parse_json

Array = NDArray[np.float64]
Matrix = list[list[float]]

# By how much the rotation of a pose, answered or stored, may be off: from float32 or few digits.
ROUNDED = 1e-3
_POSES = ("T", "T_estimated", "T_true")


@dataclass(frozen=True, kw_only=True)
class Row:
    """One pair under one method.

    Attributes
    ----------
    index, id : index and name of the pair in its data set
    T : 4x4 or None
        The pose found, source to target; None where the method failed or found nothing. Poses here are
        between the clouds minus their `offsets`, which are None except on map grids.
    T_estimated : 4x4 or None
        The pose before refinement, where the method gives it.
    error : str or None
        What the method raised, in one line.
    verdict, confidence, reasons, evidence, notes
        As in `RegistrationResult`; empty for a method that gives a pose alone.
    seconds : wall time of each stage
    peak_memory_mb : highest resident memory of the process during the run
    n_matches : matches that the pose was estimated from
    n_points : points of "source", "target" and of the downsampled "source_level", "target_level"
    T_true : 4x4 or None
        None where the pair itself could not be read.
    overlap : share of source points with a target point within `overlap_radius` metres under the true pose
    overlap_found : the same share under the pose found, where there is one
    moments : 4x4
        Second moments of those source points (`metrics.second_moments`).
    inlier_ratio : share of right matches by radius in metres, as text, before the matcher's filters
    inlier_ratio_filtered : the same after them, where they leave something out
    mask : precision, recall, f1 and iou of the overlap stage's mask, where it made one
    mask_threshold : probability above which the match stage takes a point, and the mask was scored
    """

    index: int
    id: str
    T: Matrix | None = None
    T_estimated: Matrix | None = None
    error: str | None = None
    verdict: str | None = None
    confidence: float | None = None
    reasons: list[str] = field(default_factory=list)
    evidence: dict[str, float | None] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    peak_memory_mb: float | None = None
    n_matches: int | None = None
    n_points: dict[str, int] = field(default_factory=dict)
    T_true: Matrix | None = None
    offsets: dict[str, list[float]] | None = None
    overlap: float | None = None
    overlap_radius: float | None = None
    overlap_found: float | None = None
    moments: Matrix | None = None
    inlier_ratio: dict[str, float] | None = None
    inlier_ratio_filtered: dict[str, float] | None = None
    mask: dict[str, float] | None = None
    mask_threshold: float | None = None

    def to_json(self) -> str:
        """One line of strict JSON; numbers that are not finite become null."""
        return json.dumps(_finite(asdict(self)), allow_nan=False, separators=(",", ":"))

    @classmethod
    def from_json(cls, text: str) -> Row:
        """The reverse of `to_json`.

        Raises
        ------
        ValueError
            The text is not a row, or a value is not of its field's type.
        """
        row = build(cls, parse_json(text, "not a row of predictions"), "not a row of predictions")
        if row.moments is not None and matrix(row.moments) is None:
            raise ValueError("not a row of predictions: moments is not a finite 4x4 matrix")
        for name in _POSES:
            if getattr(row, name) is not None:
                se3.check(getattr(row, name), f"not a row of predictions: {name}", ROUNDED)
        return row

    @property
    def timeless(self) -> dict[str, Any]:
        """Everything but times and memory, which alone may differ between two runs of one configuration."""
        return {key: value for key, value in asdict(self).items() if key not in ("seconds", "peak_memory_mb")}


def matrix(T: Any) -> Matrix | None:
    """A pose as nested lists, or None where it is not a finite 4x4 matrix."""
    try:
        array: Array = np.asarray(T, dtype=np.float64)
    except (TypeError, ValueError):
        return None
    if array.shape != (4, 4) or not np.isfinite(array).all():
        return None
    nested: Matrix = array.tolist()
    return nested


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
