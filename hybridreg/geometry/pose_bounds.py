# SPDX-License-Identifier: MIT
"""Which poses are possible at all: not too far from a start, and no steeper than gravity allows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3

Array = NDArray[np.float64]

# Degrees by which two measured verticals may differ: a sensor on a slope of 5 % that calls its own z "up", and more.
MOST_TILT = 6.0


@dataclass(frozen=True, eq=False, kw_only=True)
class PoseBounds:
    """Bounds of a pose between two frames whose start is the identity.

    Attributes
    ----------
    centre : (3,) float64
        Middle of the source, metres: the point whose way counts.
    start : (3,) float64
        Where the start puts it in the target's frame.
    max_translation : float or None
        Metres that it may lie away from there.
    max_rotation : float or None
        Degrees that the pose may turn away from the start.
    arm : float
        Metres from the origin of the source's own coordinates to its middle: as far as a start that is turned about
        that origin moves the middle, for each radian.
    up_source, up_target : (3,) float64 or None
        Unit vectors along the vertical, one in each frame; a pose that does not bring them together within
        `MOST_TILT` degrees is none.
    """

    centre: Array
    start: Array
    max_translation: float | None = None
    max_rotation: float | None = None
    arm: float = 0.0
    up_source: Array | None = None
    up_target: Array | None = None

    def allow(self, T: Array) -> bool:
        """Whether a pose (4, 4) lies within all bounds."""
        return not self.against(T)

    def against(self, T: Array) -> str:
        """What speaks against a pose (4, 4), in words; empty where it lies within all bounds."""
        moved = float(np.linalg.norm(se3.apply(T, self.centre[None])[0] - self.start))
        if self.max_translation is not None and not moved <= self.max_translation:
            return (
                f"{moved:.2f} m from the start, beyond max_translation={self.max_translation:g} (measured at the "
                f"middle of the source, {self.arm:.4g} m from its origin: a start that is turned by 1 degree lies "
                f"{np.radians(self.arm):.2g} m off there)"
            )
        turned = se3.angle_deg(T[:3, :3])
        if self.max_rotation is not None and not turned <= self.max_rotation:
            return f"{turned:.1f} degrees from the start, beyond max_rotation={self.max_rotation:g}"
        if self.up_source is not None and self.up_target is not None:
            cosine = float(np.clip(T[:3, :3] @ self.up_source @ self.up_target, -1.0, 1.0))
            tilt = float(np.degrees(np.arccos(cosine)))
            if not tilt <= MOST_TILT:
                return f"with both verticals {tilt:.1f} degrees apart, beyond {MOST_TILT:g}"
        return ""
