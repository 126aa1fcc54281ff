# SPDX-License-Identifier: MIT
"""Which kind of sensor took a cloud, by the directions that it covers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_BINS = 36
# A bin with less than this share of the points holds stray returns and was not scanned.
_STRAY = 0.002
_SPINNING_DEG = 300.0  # degrees from first to last direction of a spinning sensor, at least; by hand
_SPINNING_SHARE = 0.8  # of its bins that are occupied, at least; by hand
_LIMITED_DEG = 200.0  # degrees of a limited field of view, at most; by hand


@dataclass(frozen=True)
class Azimuth:
    """Horizontal coverage around the origin: from first to last direction, and the share of 360 deg."""

    span_deg: float
    share: float

    @property
    def role(self) -> str:
        """ "spinning", "limited" (a fan), or "unclear"."""
        if self.span_deg > _SPINNING_DEG and self.share >= _SPINNING_SHARE:
            return "spinning"
        return "limited" if self.span_deg < _LIMITED_DEG else "unclear"


def coverage(points: Array) -> Azimuth:
    """Coverage of points (N, 3) in their sensor's frame, z up, in bins of 10 degrees."""
    angle = np.degrees(np.arctan2(points[:, 1], points[:, 0])) % 360.0
    counts = np.bincount((angle // (360 // _BINS)).astype(int) % _BINS, minlength=_BINS)
    filled = np.flatnonzero(counts > _STRAY * len(points))
    gaps = np.diff(np.append(filled, filled[0] + _BINS)) - 1
    return Azimuth(span_deg=360.0 * (1.0 - gaps.max() / _BINS), share=len(filled) / _BINS)
