# SPDX-License-Identifier: MIT
"""Does a pose rest on the vehicle that carries the sensor, and on nothing that stands farther off?

Bonnet, mast and trailer are in each scan of a sensor, at the same place. On a field with a few posts they are most of
what stands up: the pose that leaves the sensor where it was on its carrier lets them agree to the millimetre, for any
two scans of that carrier, wherever it drove between them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.evidence.agreement import Agreement, compared
from hybridreg.evidence.traffic import LEVEL
from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3
from hybridreg.scene import SIDES, Side

Array = NDArray[np.float64]

# Metres between both sensors, or frames of a vehicle, at most: one stands where the other stood on it; by hand.
_APART = 0.5
# Metres from the sensor to the near end of a carrier, and to the far end of a car, a digger or a lorry; by hand.
_BEGINS, _ENDS = 4.0, (3.0, 6.0, 10.0)
# Thicknesses of the ground over it from which a point stands up; by hand.
_OFF_GROUND = 3.0
# Points of it that agree, at least, and share of these which may agree beyond it; by hand. Of seven poses of made
# carriers that were wrong and "ok", none agrees beyond it at all; of 14 right ones of a sensor that stood still, on
# fields and streets, one has less than a quarter, which is "doubtful" anyway, and of real pairs none less than 1.3.
_FEWEST, _REST = 10, 0.1
# Share of what both sensors see that lies beyond it, at least: a small room ends there; by hand.
_BEYOND = 0.4


def rests_on_carrier(views: Views, T_target_source: Array, agreement: Agreement) -> float | None:
    """Metres around both sensors within which all stands that agrees under a pose (4, 4), though both see farther; None
    where more agrees, or the pose puts the sensors at two places."""
    ground = views.target.ground
    if views.up is None or ground is None:
        return None
    other, place = (_place(views, side) for side in SIDES)
    if np.linalg.norm(se3.apply(T_target_source, other[None])[0] - place) > _APART:
        return None
    points, normals, looked, agrees = compared(views, agreement)
    off_ground = ground.above(points) > _OFF_GROUND * views.target.thickness
    holds = looked & agrees & off_ground & (np.abs(normals @ views.up) < LEVEL)
    away = np.linalg.norm(points - place, axis=1)
    if np.count_nonzero(holds & (away < _BEGINS)) < _FEWEST:
        return None
    for end in _ENDS:
        within, beyond = np.count_nonzero(holds & (away < end)), np.count_nonzero(holds & (away >= end))
        if beyond <= _REST * within and np.count_nonzero(looked & (away >= end)) > _BEYOND * looked.sum():
            return end
    return None


def _place(views: Views, side: Side) -> Array:
    # Of the sensor; where that is not known, as in a vehicle's frame, the origin, which lies in the carrier then.
    view: View = getattr(views, side)
    cloud: PointCloud = getattr(views.scene.pair, side)
    return view.centre if view.image is not None else -cloud.offset
