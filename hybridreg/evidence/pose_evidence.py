# SPDX-License-Identifier: MIT
"""What both clouds say about one pose; each part is computed when it is first asked for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import information, one_thing, own_carrier, traffic
from hybridreg.evidence.agreement import Agreement, compare
from hybridreg.evidence.deformation import (
    bend,
    changed_ground,
    heights,
    motion_distortion,
    scale,
    second_layer,
    sensor_offset,
    stretch,
)
from hybridreg.evidence.deformation.bend import Bend
from hybridreg.evidence.deformation.changed_ground import ChangedGround
from hybridreg.evidence.deformation.deformed import Deformed, Onto, closeness_of
from hybridreg.evidence.deformation.motion_distortion import MotionDistortion
from hybridreg.evidence.deformation.scale import Size
from hybridreg.evidence.deformation.second_layer import SecondLayer
from hybridreg.evidence.deformation.sensor_offset import SensorOffset
from hybridreg.evidence.deformation.stretch import Stretch
from hybridreg.evidence.evidence import Evidence
from hybridreg.evidence.information import Information
from hybridreg.evidence.log_odds import log_odds
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
        return scale.size(self.views, self.T, self.closeness, self._explained)

    @cached_property
    def sensor_offset(self) -> SensorOffset | None:
        """The offset of one sensor's ranges and elevations at which its cloud fits better."""
        return sensor_offset.sensor_offset(self.views, self.T)

    @cached_property
    def stretch(self) -> Stretch | None:
        """How the source must be stretched to fit better, if it must."""
        along = stretch.stretch(self.views, self.T, self.closeness, self._explained)
        off = self.sensor_offset is not None and self.sensor_offset.told
        return along if along or off else heights.heights(self.views, self.T)

    @cached_property
    def motion_distortion(self) -> MotionDistortion | None:
        """How a sensor moved while it measured, if one did."""
        return motion_distortion.motion_distortion(self.views, self.T)

    @cached_property
    def bend(self) -> Bend | None:
        """How far away a part of a map lies better, if one does."""
        return bend.bend(self.views, self.T)

    @cached_property
    def second_layer(self) -> SecondLayer | None:
        """Much of a cloud that lies on the other one elsewhere, if any."""
        return second_layer.second_layer(self.views, self.T)

    @cached_property
    def changed_ground(self) -> ChangedGround | None:
        """By how much the ground was raised or lowered between both clouds, if it was."""
        return changed_ground.changed_ground(self.views, self.T)

    def _explained(self, fitted: Array) -> bool:
        # Whether a sensor's offset, or its motion, lets the clouds lie more closely than another
        # deformation (4, 4), affine: nothing is strained then.
        offset, motion = self.sensor_offset, self.motion_distortion
        strained = closeness_of(Onto.target(self.views), Deformed(fitted))
        if offset is not None and offset.close >= strained:
            return True
        return motion is not None and motion.explains(strained)

    @cached_property
    def traffic(self) -> Array | None:
        """The direction (3,) along which vehicles alone hold the pose, if any."""
        return traffic.held_along(self.views, self.agreement)

    @cached_property
    def one_thing(self) -> Array | None:
        """The direction (3,) along which one thing alone holds the pose, and the rest contradicts it, if any."""
        return one_thing.held_by_one(self.views, self.T, self.agreement)

    @cached_property
    def own_carrier(self) -> float | None:
        """Metres around both sensors, at one place, within which all stands that agrees, if they see farther."""
        return own_carrier.rests_on_carrier(self.views, self.T, self.agreement)
