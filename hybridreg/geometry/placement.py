# SPDX-License-Identifier: MIT
"""Where two clouds were put before the search, so that its pose can be told in the user's coordinates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3

Array = NDArray[np.float64]


class Placement(NamedTuple):
    """Rigid motions (4, 4) of both clouds, after the source was made `scale` times as large.

    A source point p of the user's lies at `source (scale p)`, a target point q at `target q`. `margin` tells how much
    better than its neighbours that size is, nats per point.
    """

    source: Array
    target: Array
    scale: float = 1.0
    margin: float = 0.0

    def raised(self, T: Array) -> Array:
        """Pose (4, 4) of the user's clouds, of one between the placed ones: `q = R (scale p) + t`."""
        return se3.inverse(self.target) @ T @ self.source

    def lowered(self, T: Array) -> Array:
        """The reverse of `raised`."""
        return self.target @ T @ se3.inverse(self.source)
