# SPDX-License-Identifier: MIT
"""What both clouds say about one pose; each part is computed when it is first asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import information, range_offset, scale, stretch, traffic
from hybridreg.evidence.agreement import Agreement, compare
from hybridreg.evidence.evidence import Evidence
from hybridreg.evidence.information import Information
from hybridreg.evidence.log_odds import log_odds
from hybridreg.evidence.range_offset import RangeOffset
from hybridreg.evidence.scale import Size
from hybridreg.evidence.stretch import Stretch
from hybridreg.evidence.surface_distance import closeness
from hybridreg.evidence.views import Views

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PoseEvidence:
    """Both clouds of `views` under the pose T (4, 4), from all sampled points."""

    views: Views
    T: Array

    @cached_property
    def agreement(self) -> Agreement:
        """Where both sensors looked, did they see the same surfaces?"""
        return compare(self.views, self.T)

    @cached_property
    def information(self) -> Information:
        """How firmly the surfaces hold the pose."""
        return information.measure(self.agreement, self.views.target)

    @cached_property
    def by_surfaces(self) -> float:
        """Log-odds that the pose is right, by the surfaces alone."""
        return log_odds(Evidence.at(self.agreement, self.information))

    @cached_property
    def closeness(self) -> float:
        """Nats per point by which the points lie closer to the surfaces than by chance."""
        return closeness(self.views.fine, self.T)

    @cached_property
    def size(self) -> Size:
        """The size at which the source fits better, if any."""
        return scale.size(self.views, self.T, self.closeness, self.range_offset)

    @cached_property
    def range_offset(self) -> RangeOffset | None:
        """The offset of the source's ranges at which it fits better."""
        return range_offset.range_offset(self.views, self.T)

    @cached_property
    def stretch(self) -> Stretch | None:
        """How the source must be stretched to fit better, if it must."""
        return stretch.stretch(self.views, self.T, self.closeness, self.range_offset)

    @cached_property
    def traffic(self) -> Array | None:
        """The direction (3,) along which vehicles alone hold the pose, if any."""
        return traffic.held_along(self.views, self.agreement)
