# SPDX-License-Identifier: MIT
"""Are all ranges of the source off by as much? Near by, that looks like another size or a stretch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import Onto, closeness_of, fit, rigidly
from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3
from hybridreg.resolution import Tolerance, tolerance

Array = NDArray[np.float64]

# Metres, and nats per point that it must gain, from which an offset is told; by hand. Of 18 real pairs one gains as
# much, by 0.12 m.
_TOLD, _GAIN = 0.15, 0.15
# Metres; points nearer to the sensor have no direction.
_NEAR = 1e-6


class RangeOffset(NamedTuple):
    """What must be added to the source's ranges to fit best.

    Attributes
    ----------
    metres : float
    close : float
        Nats per point, see `hybridreg.evidence.deformation.deformed.closeness_of`.
    told : bool
        Whether it is large, and fits clearly better.
    beyond : bool
        Whether it moves the pose by more than the tolerance.
    """

    metres: float
    close: float
    told: bool
    beyond: bool


def range_offset(views: Views, T_target_source: Array) -> RangeOffset | None:
    """The offset about a pose (4, 4); None where it is not known where the source was seen from."""
    if views.source.image is None:
        return None

    def field(points: Array) -> Array:
        return _directions(points, views.source)[None]

    onto = Onto.target(views)
    found = fit(onto, T_target_source, field=field)
    close, metres = closeness_of(onto, found, field), float(found.amounts[0])
    pair = views.scene.pair
    off = Tolerance.between(T_target_source, found.T, se3.apply(T_target_source, views.middle)[0])
    return RangeOffset(
        metres=metres,
        close=close,
        told=abs(metres) > _TOLD and close - rigidly(onto, T_target_source) > _GAIN,
        beyond=not off.within(tolerance(pair.source, pair.target)),
    )


def _directions(points: Array, view: View) -> Array:
    # Unit vectors (n, 3) from where the cloud was seen from to its points.
    rays = points - view.centre
    return rays / np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), _NEAR)
