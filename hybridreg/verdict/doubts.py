# SPDX-License-Identifier: MIT
"""What keeps a pose from "ok" that the trees believe: rules for what they do not see."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import corner, lone_thing, silhouette
from hybridreg.evidence.covariance import of_information
from hybridreg.evidence.deformation.bend import Bend
from hybridreg.evidence.deformation.changed_ground import ChangedGround
from hybridreg.evidence.deformation.motion_distortion import MotionDistortion
from hybridreg.evidence.deformation.second_layer import SecondLayer
from hybridreg.evidence.deformation.sensor_offset import SensorOffset
from hybridreg.evidence.deformation.stretch import Stretch
from hybridreg.evidence.evidence import Evidence
from hybridreg.evidence.log_odds import FAILED
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry.ground_relief import TELLS
from hybridreg.resolution import Tolerance, tolerance
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import Hypothesis
from hybridreg.verdict.confidence import SIZE_GAIN, confidence
from hybridreg.verdict.one_place import Rivalled, rivalled

Array = NDArray[np.float64]

# Share of the walls drawn through flat scans that may be seen through: of 59 right poses on training pairs none has
# more than 0.03, of the wrong ones that are likely otherwise none less than 0.05.
_THROUGH_WALLS = 0.04
# Log-odds from which a rival may be right though it is far behind, where nothing shows which way is up, or walls are
# all there is: of a box that was seen from two sides, a wrong turn lays one side upon the other, and more agrees than
# at the true pose. Of 795 right training poses 27 have such a rival; by hand.
_ALIKE = 2.0
# Standard deviations within which 95 % of a normal distribution lie.
_MOST_LIKELY = 1.96


@dataclass(frozen=True, eq=False, kw_only=True)
class Doubts:
    """What each rule says of one pose.

    Attributes
    ----------
    slack : Tolerance or None
        By how much a right pose may well be off, where that is more than the tolerance.
    through_walls : bool
        Walls drawn through flat scans are seen through.
    alike : bool
        A rival is likely by itself where little tells which of two is right.
    lone_thing : bool
        One thing is seen from one side, and nothing known beforehand excludes the opposite side.
    seen_past : bool
        One thing stands alone in both views, and its outlines do not coincide.
    corner : bool
        Nothing agrees but the planes of one corner of a room, and nothing known beforehand excludes another.
    one_place : Rivalled or None
        Rivals that little contradicts, where by the pose both clouds were seen from one place.
    stretch : Stretch or None
        How the source fits better.
    sensor_offset : SensorOffset or None
        What added to a sensor's ranges or elevations makes its cloud fit clearly better; no doubt where the pose lies
        within the tolerance all the same.
    motion_distortion : MotionDistortion or None
        How a sensor moved while it measured; no doubt where the pose lies within the tolerance.
    bend : Bend or None
        How far away a part of a map lies better.
    second_layer : SecondLayer or None
        Much of a cloud that lies on the other one elsewhere.
    changed_ground : ChangedGround or None
        The ground was raised or lowered between both clouds, against what stands on it.
    traffic : (3,) float64 or None
        Direction along which vehicles alone hold the pose.
    one_thing : (3,) float64 or None
        Direction along which one thing alone holds it, while the rest contradicts it.
    own_carrier : float or None
        Metres around both sensors, which stand at one place, within which all stands that agrees.
    """

    slack: Tolerance | None
    through_walls: bool
    alike: bool
    lone_thing: bool = False
    seen_past: bool = False
    corner: bool = False
    one_place: Rivalled | None = None
    stretch: Stretch | None = None
    sensor_offset: SensorOffset | None = None
    motion_distortion: MotionDistortion | None = None
    bend: Bend | None = None
    second_layer: SecondLayer | None = None
    changed_ground: ChangedGround | None = None
    traffic: Array | None = None
    one_thing: Array | None = None
    own_carrier: float | None = None

    def __bool__(self) -> bool:
        return self.about_pose or self.about_source

    @property
    def about_pose(self) -> bool:
        """Whether another pose may be right."""
        told = (self.slack, self.traffic, self.one_thing, self.own_carrier, self.one_place)
        found = any(each is not None for each in told)
        return found or any((self.through_walls, self.alike, self.lone_thing, self.seen_past, self.corner))

    @property
    def about_source(self) -> bool:
        """Whether a cloud is deformed, so that no pose is right."""
        known = (self.sensor_offset, self.motion_distortion)
        beyond = any(one is not None and one.beyond for one in known)
        parts = (self.stretch, self.bend, self.second_layer, self.changed_ground)
        found = any(each is not None for each in parts)
        return found or beyond

    def of_pose(self) -> Doubts:
        """Those that are not about a deformed cloud."""
        return replace(
            self,
            stretch=None,
            sensor_offset=None,
            motion_distortion=None,
            bend=None,
            second_layer=None,
            changed_ground=None,
        )

    @classmethod
    def about(
        cls, scene: Scene, at: PoseEvidence, found: list[Hypothesis], evidence: Evidence, *, likely: bool
    ) -> Doubts:
        """About a pose and its rivals; the rules that take time are tried where it is `likely`."""
        quick = cls(
            slack=_slack(scene, at),
            through_walls=scene.pair.drawn and evidence.looked_through_rare > _THROUGH_WALLS,
            alike=(scene.pair.drawn or at.views.up is None)
            and any(one.by_surfaces > _ALIKE for one in found),
        )
        if not likely:
            return quick
        opposite, offset, motion = lone_thing.opposite(scene, at), at.sensor_offset, at.motion_distortion
        strained = at.stretch is not None or evidence.size_gain > SIZE_GAIN
        offset = offset if offset is not None and offset.told and not strained else None
        moved = None if strained or (offset and motion and not motion.explains(offset.close)) else motion
        doubts = replace(
            quick,
            lone_thing=opposite is not None and scene.pair.allows(opposite),
            seen_past=silhouette.seen_past(at.views, evidence.looked_through),
            one_place=rivalled(at, found),
            corner=corner.bare_corner(at) and corner.others_allowed(scene.pair, at),
            stretch=at.stretch,
            sensor_offset=None if moved else offset,
            motion_distortion=moved,
            bend=None if strained else at.bend,
            second_layer=None if strained else at.second_layer,
            traffic=None if scene.pair.drawn else at.traffic,
            own_carrier=None if scene.pair.drawn else at.own_carrier,
        )
        if scene.pair.drawn or doubts.about_source:
            return doubts
        doubts = replace(doubts, changed_ground=at.changed_ground)
        # Of a deformed cloud most lies elsewhere.
        return doubts if doubts.about_source else replace(doubts, one_thing=at.one_thing)


def is_right_but_for_size(scene: Scene, at: PoseEvidence, evidence: Evidence) -> bool:
    """Whether the pose of a source of another size lies where that source fits: it would not fail but for its size."""
    allowed = tolerance(scene.pair.source, scene.pair.target)
    resized = evidence.size_gain > SIZE_GAIN and at.size.off.within(allowed)
    return resized and confidence(replace(evidence, size_gain=0.0)) >= FAILED


def _slack(scene: Scene, at: PoseEvidence) -> Tolerance | None:
    # The covariance leaves out what relief adds.
    if at.agreement.relief.information > TELLS:
        return None
    allowed = tolerance(scene.pair.source, scene.pair.target)
    C = of_information(at.information.matrix, allowed)
    turn, shift = (_MOST_LIKELY * _worst(part) for part in (C[:3, :3], C[3:, 3:]))
    off = Tolerance(float(np.degrees(turn)), shift)
    return None if off.within(allowed) else off


def _worst(covariance: Array) -> float:
    # Standard deviation along the direction of the largest.
    if not np.isfinite(covariance).all():
        return np.inf
    return float(np.sqrt(np.linalg.eigvalsh(covariance)[-1]))
