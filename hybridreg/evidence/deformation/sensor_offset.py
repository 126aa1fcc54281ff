# SPDX-License-Identifier: MIT
"""Does a sensor measure all ranges, or all elevations, off by as much?

Near by, an offset of the ranges looks like another size or a stretch. One of the elevations makes a cone of the ground,
and the best pose leans on one side of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import Field, Onto, closeness_of, fit, rigidly
from hybridreg.evidence.views import View, Views
from hybridreg.resolution import tolerance
from hybridreg.scene import Side

Array = NDArray[np.float64]

# Metres, degrees, and nats per point that it must gain, from which an offset is told; by hand. Of 18 real pairs one
# gains as much by its ranges, 0.12 m, and one by its elevations, 1.04 degrees; of the elevations of 150 right poses of
# hard kinds none gains more than 0.1.
_METRES, _DEGREES, _GAIN = 0.15, 1.25, 0.15
# Metres; points nearer to the sensor have no direction.
_NEAR = 1e-6
# Cosine of an elevation, at least: straight above the sensor none is higher than another; by hand.
_STEEPEST = 0.05


class SensorOffset(NamedTuple):
    """What must be added to all that one sensor measured to fit best.

    Attributes
    ----------
    side : "source" or "target"
    metres : float
        Added to its ranges.
    degrees : float
        Added to its elevations, upwards from the ground, also where the sensor hangs upside down.
    close : float
        Nats per point, see `hybridreg.evidence.deformation.deformed.closeness_of`.
    gain : float
        By which that is more than under any rigid pose near by; 0 where the offset is too small to be told.
    beyond : bool
        Whether it moves the pose by more than the tolerance.
    """

    side: Side
    metres: float
    degrees: float
    close: float
    gain: float
    beyond: bool

    @property
    def told(self) -> bool:
        """Whether it is large, and fits clearly better."""
        return self.gain > _GAIN

    @property
    def in_range(self) -> bool:
        """Whether its ranges are off by as much as is told."""
        return abs(self.metres) > _METRES

    @property
    def in_elevation(self) -> bool:
        """Whether its elevations are."""
        return abs(self.degrees) > _DEGREES


def sensor_offset(views: Views, T_target_source: Array) -> SensorOffset | None:
    """The offset about a pose (4, 4) of the sensor that is off more clearly, else of the source's; None where it is not
    known where the clouds were seen from."""
    ways = Onto.both_ways(views, T_target_source)
    found = [_offset(views, side, onto, T) for side, onto, T in ways if onto.moved.image is not None]
    return max(found, key=lambda one: one.gain, default=None)


def _offset(views: Views, side: Side, onto: Onto, T: Array) -> SensorOffset:
    field = _field(onto.moved)
    fitted = fit(onto, T, field=field)
    close = closeness_of(onto, fitted, field)
    pair = views.scene.pair
    found = SensorOffset(
        side=side,
        metres=float(fitted.amounts[0]),
        degrees=float(np.degrees(fitted.amounts[1])),
        close=close,
        gain=0.0,
        beyond=not onto.moved_off(T, fitted.T).within(tolerance(pair.source, pair.target)),
    )
    return found._replace(gain=close - rigidly(onto, T)) if found.in_range or found.in_elevation else found


def _field(view: View) -> Field:
    """Displacements of points by a metre of range, and by a radian of elevation."""
    up = view.upward

    def field(points: Array) -> Array:
        rays = points - view.centre
        ranges = np.linalg.norm(rays, axis=1, keepdims=True)
        ahead = rays / np.maximum(ranges, _NEAR)
        higher = up - ahead * (ahead @ up)[:, None]
        higher /= np.maximum(np.linalg.norm(higher, axis=1, keepdims=True), _STEEPEST)
        return np.array([ahead, ranges * higher])

    return field
