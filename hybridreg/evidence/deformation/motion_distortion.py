# SPDX-License-Identifier: MIT
"""Did a sensor move while it measured (motion distortion)?

A spinning sensor takes a tenth of a second for one sweep. Unless its points are put back to one moment (deskewed),
those before and after the place where the sweep begins lie apart by what the sensor turned and moved meanwhile, and no
rigid pose is right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import (
    FEWEST,
    POINTS,
    TRUST,
    Deformed,
    Field,
    Onto,
    closeness_of,
    fit,
    rigidly,
)
from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3
from hybridreg.geometry.point_to_plane import jacobian
from hybridreg.geometry.range_image import RangeImage
from hybridreg.resolution import Tolerance, tolerance
from hybridreg.scene import Side

Array = NDArray[np.float64]

# Directions in which a sweep may begin, and how many of them are fitted, the most promising; by hand.
_STARTS, _FITTED = np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False), 4
# Farthest partners, spacings, of the points whose distances it must explain, and the share of these from which it is
# fitted: by hand. Of some 50 right poses, real and of `sim:val`, most explain less; of those whose source was distorted
# so that the pose is off, hardly any.
_REACH, _EXPLAINED = 3.0, 0.08
# Nats per point that it must gain: by hand. Of 18 real pairs and 32 of `sim:val` two gain more than 0.08, both taken by
# sensors that moved; a turn by three degrees gains 0.25 and more, where the sensor looks around.
_GAIN = 0.15
# Nats per point by which it must lie closer than a strain, or an offset of all ranges, that has one amount to fit; by
# hand.
_BETTER = 0.1
# Share of the cloud's points that must lie near the other's surfaces then: few fit any motion. By hand; of 240 right
# poses of `sim:val` three gain as much, with a third of the points at most.
_NEAR = 0.4
# No sensor turns, or moves, farther within one sweep: by hand.
_MOST_RAD, _MOST_METRES = np.radians(45.0), 6.0


class MotionDistortion(NamedTuple):
    """How one cloud's sensor moved during a sweep.

    Attributes
    ----------
    side : "source" or "target"
    degrees, metres : float
        By which it turned about the vertical, and moved on the level, from the start of the sweep to its end.
    close : float
        Nats per point by which the cloud lies closer to the other's surfaces than by chance, its motion undone.
    gain : float
        By which that is more than under any rigid pose near by.
    beyond : bool
        Whether the pose is off by more than the tolerance: at the middle of the sweep, or at its start and end, since
        nobody knows which moment it is for.
    """

    side: Side
    degrees: float
    metres: float
    close: float
    gain: float
    beyond: bool

    def explains(self, close: float) -> bool:
        """Whether it explains the clouds better than another deformation that lies so `close`, and has less to fit."""
        return self.close >= close + _BETTER


def motion_distortion(views: Views, T_target_source: Array) -> MotionDistortion | None:
    """The motion about a pose (4, 4) of the sensor that moved more clearly; None where neither did, or where it is not
    known that one sensor took a cloud from one place."""
    tried = (_moved(views, onto, side, T) for side, onto, T in Onto.both_ways(views, T_target_source))
    return max((one for one in tried if one is not None), key=lambda one: one.gain, default=None)


def _moved(views: Views, onto: Onto, side: Side, T: Array) -> MotionDistortion | None:
    if not isinstance(onto.moved.image, RangeImage):
        return None
    fitted = [(field, fit(onto, T, field=field)) for field in _promising(onto, T)]
    if not fitted:
        return None
    closes = [closeness_of(onto, found, field) for field, found in fitted]
    close = max(closes)
    field, found = fitted[closes.index(close)]
    turn, metres = float(abs(found.amounts[0])), float(np.linalg.norm(found.amounts[1:]))
    gain = close - rigidly(onto, T)
    if gain < _GAIN or turn > _MOST_RAD or metres > _MOST_METRES or _share_near(onto, found, field) < _NEAR:
        return None
    pair = views.scene.pair
    off = onto.moved_off(T, found.T)
    half = Tolerance(float(np.degrees(turn)) / 2.0, metres / 2.0)
    allowed = tolerance(pair.source, pair.target)
    return MotionDistortion(
        side=side,
        degrees=float(np.degrees(turn)),
        metres=metres,
        close=close,
        gain=gain,
        beyond=not (off.within(allowed) and half.within(allowed)),
    )


def _share_near(onto: Onto, found: Deformed, field: Field) -> float:
    points = onto.fine.asked
    moved = se3.apply(found.T, found.added(points, field(points)))
    return float(np.mean(onto.other_fine.near(moved)))


def _promising(onto: Onto, T: Array) -> list[Field]:
    # Of the directions in which the sweep may begin, those by which a motion explains most of the distances to the
    # planes, beyond what a motion of the whole cloud explains; none where that is little.
    fields = [_field(onto.moved, start) for start in _STARTS]
    points = onto.moved.points[onto.moved.settling[:POINTS]]
    moved = se3.apply(T, points)
    reach = _REACH * onto.spacing
    distance, match = onto.other.tree.query(moved, distance_upper_bound=reach)
    hit = np.isfinite(distance)
    if np.count_nonzero(hit) < FEWEST:
        return []
    points, moved, row = points[hit], moved[hit], match[hit]
    normals = onto.other.facing(row)
    gap = np.einsum("ni,ni->n", moved - onto.other.points[row], normals)
    weight = 1.0 / np.hypot(1.0, gap / max(onto.spacing, TRUST * reach))  # the root of a Cauchy weight
    rigid = np.linalg.qr(jacobian(moved - moved.mean(axis=0), normals) * weight[:, None])[0]

    def left(columns: Array) -> Array:
        return columns - rigid @ (rigid.T @ columns)

    rest = left(gap * weight)
    whole = float(rest @ rest)
    shares = []
    for field in fields:
        along = np.einsum("ni,kni->nk", normals @ T[:3, :3], field(points))
        own = np.linalg.qr(left(along * weight[:, None]))[0]
        shares.append(float(np.sum((own.T @ rest) ** 2)) / whole if whole > 0.0 else 0.0)
    if max(shares) < _EXPLAINED:
        return []
    return [fields[k] for k in np.argsort(shares)[::-1][:_FITTED]]


def _field(view: View, start: float) -> Field:
    """Displacements of points by a turn of one radian, and by a metre along either level direction, during a sweep that
    begins in a direction of `start` radians and goes once around; none in the middle of the sweep."""
    up = view.upward
    along, across, _ = se3.turn_to_z(up)

    def field(points: Array) -> Array:
        arms = points - view.centre
        azimuth = np.arctan2(arms @ across, arms @ along)
        phase = (((azimuth - start) / (2.0 * np.pi)) % 1.0 - 0.5)[:, None]
        return np.array([phase * np.cross(up, arms), phase * along, phase * across])

    return field
