# SPDX-License-Identifier: MIT
"""Are all ranges of the source off by as much? Near by, that looks like another size or a stretch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformed import NO_STRAIN, Deformed, closeness_of, fit
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.resolution import Tolerance, tolerance

Array = NDArray[np.float64]

# Metres, and nats per point that it must gain, from which an offset is told; by hand. Of 18 real pairs one gains as
# much, by 0.12 m.
_TOLD, _GAIN = 0.15, 0.15


class RangeOffset(NamedTuple):
    """What must be added to the source's ranges to fit best.

    Attributes
    ----------
    metres : float
    close : float
        Nats per point, see `hybridreg.evidence.deformed.closeness_of`.
    told : bool
        Whether it is large, and fits clearly better.
    beyond : bool
        Whether it moves the pose by more than the tolerance.
    """

    metres: float
    close: float
    told: bool
    beyond: bool

    def explains(self, views: Views, T_target_source: Array) -> bool:
        """Whether the source lies as closely with it as under another deformation (4, 4), affine: nothing is strained
        then."""
        return self.close >= closeness_of(views, Deformed(T_target_source))


def range_offset(views: Views, T_target_source: Array) -> RangeOffset | None:
    """The offset about a pose (4, 4); None where it is not known where the source was seen from."""
    if views.source.image is None:
        return None
    found = fit(views, T_target_source, NO_STRAIN, ranges=True)
    close = closeness_of(views, found)
    pair = views.scene.pair
    off = Tolerance.between(T_target_source, found.T, se3.apply(T_target_source, views.middle)[0])
    return RangeOffset(
        metres=found.offset,
        close=close,
        told=abs(found.offset) > _TOLD and close - _rigidly(views, T_target_source) > _GAIN,
        beyond=not off.within(tolerance(pair.source, pair.target)),
    )


def _rigidly(views: Views, T: Array) -> float:
    # What the pose gives, or one near by.
    return max(closeness_of(views, each) for each in (Deformed(T), fit(views, T, NO_STRAIN)))
