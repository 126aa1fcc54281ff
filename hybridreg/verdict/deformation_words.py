# SPDX-License-Identifier: MIT
"""What is told of clouds that no rigid pose lays right."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.bend import Bend
from hybridreg.evidence.deformation.changed_ground import ChangedGround
from hybridreg.evidence.deformation.motion_distortion import MotionDistortion
from hybridreg.evidence.deformation.second_layer import SecondLayer
from hybridreg.evidence.deformation.sensor_offset import SensorOffset
from hybridreg.evidence.deformation.stretch import Stretch
from hybridreg.evidence.evidence import Evidence
from hybridreg.verdict.confidence import SIZE_GAIN
from hybridreg.verdict.doubts import Doubts

Array = NDArray[np.float64]


def of_deformed_clouds(evidence: Evidence, doubts: Doubts) -> Iterator[str]:
    """In sentences: how a cloud is deformed, or held twice, and what to do."""
    yield from _strained(evidence, doubts.stretch)
    yield from _off(doubts.sensor_offset)
    yield from _in_motion(doubts.motion_distortion)
    yield from _bent(doubts.bend)
    yield from _twice(doubts.second_layer)
    yield from _raised(doubts.changed_ground)


def three(direction: Array) -> str:
    return " ".join(f"{x:.2f}" for x in np.round(direction, 2) + 0.0)  # no "-0.00"


def _strained(evidence: Evidence, stretch: Stretch | None) -> Iterator[str]:
    resized = evidence.size_gain > SIZE_GAIN
    if stretch and not stretch.is_size:
        yield (
            f"the source fits better when it is stretched by {100.0 * (stretch.factor - 1.0):+.1f} % along "
            f"({three(stretch.direction)}) of the target, so no rigid pose is right: was it taken in motion, is an "
            "axis in another unit, or does the map bend? Undo that first, or register a smaller part"
        )
    elif stretch or resized:
        scale = evidence.scale if resized or not stretch else 0.5 * (stretch.factor + stretch.across)
        yield (
            f"the source fits better when it is multiplied by {scale:.3f}: "
            "is it scaled, or its sensor's calibration off?"
        )


def _off(offset: SensorOffset | None) -> Iterator[str]:
    if offset is None:
        return
    amounts = []
    if offset.in_range:
        amounts.append(
            f"ranges are {abs(offset.metres):.2f} m {'longer' if offset.metres > 0.0 else 'shorter'}"
        )
    if offset.in_elevation:
        amounts.append(
            f"elevations are {abs(offset.degrees):.1f} deg {'higher' if offset.degrees > 0.0 else 'lower'}"
        )
    harm = ", and the pose moves by more than the tolerance then" if offset.beyond else ""
    yield (
        f"the {offset.side} fits better when all its {' and all its '.join(amounts)}{harm}: is one of the sensors "
        "calibrated badly?"
    )


def _in_motion(motion: MotionDistortion | None) -> Iterator[str]:
    if motion is not None:
        harm = ", so that no rigid pose is right" if motion.beyond else ""
        yield (
            f"the {motion.side} fits better when its sensor turned by {motion.degrees:.1f} deg and moved by "
            f"{motion.metres:.2f} m within one sweep{harm}: undo its motion by the times of its points (deskew it) "
            "before it is registered"
        )


def _bent(bend: Bend | None) -> Iterator[str]:
    if bend is not None:
        yield (
            f"a part of the clouds fits better {bend.metres:.2g} m and {bend.degrees:.1f} deg away from where the pose "
            "lays it, so that no rigid pose is right: does a map drift or bend? Close its loops, or register smaller "
            "parts"
        )


def _twice(layer: SecondLayer | None) -> Iterator[str]:
    if layer:
        yield (
            f"{layer.share:.0%} of what stands in the {layer.side} lies on the other cloud {layer.metres:.2g} m and "
            f"{layer.degrees:.1f} deg away from the rest: does it hold a place twice, as a map with open loops, is a "
            "sweep put together of two moments, or did much move together?"
        )


def _raised(ground: ChangedGround | None) -> Iterator[str]:
    if ground:
        side, other = ("target", "source") if ground.metres > 0.0 else ("source", "target")
        yield (
            f"what stands on the ground fits better when the ground of the {side} is taken to lie "
            f"{abs(ground.metres):.2g} m higher than that of the {other}: was it raised or dug away between the scans "
            "(snow, earthworks, water)? The pose lays ground on ground; to lay what stands there, leave the ground out"
        )
