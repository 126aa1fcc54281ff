# SPDX-License-Identifier: MIT
"""Where both sensors looked, did they see the same surfaces? Visibility, free space and agreement under one pose.

A share of all points is a poor score. Points that the other sensor could not see lower it for a right pose, and the
ground raises it for a wrong one. So only points visible to the other sensor are counted, and they are counted
separately for three directions of normals: the ground constrains the height, the walls along a street the motion
across it, and the few surfaces that face along the street decide whether the clouds may slide.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.orientation import overturned
from hybridreg.evidence.relief_repeats import beyond
from hybridreg.evidence.views import View, Views
from hybridreg.geometry import se3
from hybridreg.geometry.ground_relief import Alike, alike
from hybridreg.geometry.main_axes import faced, main_axes
from hybridreg.geometry.range_image import Seen
from hybridreg.runtime.cores import query_threads

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Spacings within which a point counts as covered by the other cloud; by hand.
_COVERED = 2.0
# Spacings off the other surface's plane within which it agrees; by hand.
_ACROSS = 0.5
# Spacings by which two ranges of one surface may differ; by hand.
_MARGIN = 1.0
# Spacings that a surface extends to the side of its points; by hand.
_REACH = 1.0
# Cosine between two normals of one surface: estimated from different sensors' samples, they seldom differ by more than
# 45 degrees.
_SAME_NORMAL = float(np.cos(np.radians(45.0)))
# Points added to every count of visible ones: so few agreeing points are a coincidence; by hand.
PSEUDO_COUNT = 20.0
# Nats up to which a relief hardly speaks for a pose, and it does not matter whether it repeats; by hand.
_SPEAKS = 5.0
# Without a range image a point counts as visible where the other cloud has any point within so many spacings; by hand.
_SURROUNDED = 6.0


@dataclass(frozen=True, eq=False, kw_only=True)
class OneWay:
    """The sampled points of one cloud in the frame of the other.

    looked : (m,) bool, visible: the other sensor measured this place or beyond it
    free : (m,) bool, it measured beyond: the point violates free space
    hidden : (m,) bool, occluded: it measured something nearer
    covered : (m,) bool, the other cloud has a point near by
    agrees : (m,) bool, covered, on the same surface, with the same normal
    match : (m,) int64, row of the nearest point of the other cloud where covered, else -1
    moved, normals : (m, 3) float64, in the other cloud's frame
    """

    looked: Mask
    free: Mask
    hidden: Mask
    covered: Mask
    agrees: Mask
    match: NDArray[np.int64]
    moved: Array
    normals: Array

    def of(self, pose: int) -> OneWay:
        """Of one of several poses, whose fields have a leading axis."""
        return OneWay(**{field.name: getattr(self, field.name)[pose] for field in fields(self)})


@dataclass(frozen=True, eq=False, kw_only=True)
class Agreement:
    """Both clouds under one pose.

    axes : (3, 3) float64, rows: main directions of the normals in the target's frame, the commonest first
    looked, agreed, through : (3,) float64, points that face each axis: visible to the other sensor, agreeing, and
        violating free space; both clouds together
    relief : Alike
        How well the ground relief of both clouds correlates, beyond what it repeats.
    overturned : bool
        The world is upside down, or a sensor stands below the other's ground.
    """

    source: OneWay
    target: OneWay
    axes: Array
    looked: Array
    agreed: Array
    through: Array
    relief: Alike
    overturned: bool

    @property
    def shares(self) -> Array:
        """Agreeing share (3,) of the visible points, for each axis; few points count for little."""
        return self.agreed / (self.looked + PSEUDO_COUNT)

    @property
    def looked_through(self) -> float:
        """Share of the visible points that violate free space."""
        return float(self.through.sum() / (self.looked.sum() + PSEUDO_COUNT))

    @property
    def rare(self) -> tuple[float, float, float]:
        """Points visible, agreeing and violating free space that do not face the commonest axis: on a field, all but
        the ground."""
        return float(self.looked[1:].sum()), float(self.agreed[1:].sum()), float(self.through[1:].sum())


def in_target(views: Views, agreement: Agreement) -> list[tuple[View, OneWay, Array, Array]]:
    """Of either cloud the view, how its sampled points do under the pose, and these (m, 3) with their normals in the
    target's frame."""
    source, target = views.source, views.target
    forth, back = agreement.source, agreement.target
    return [
        (source, forth, forth.moved, forth.normals),
        (target, back, target.points[target.asked], target.normals[target.asked]),
    ]


class Compared(NamedTuple):
    """The sampled points (n, 3) of both clouds under a pose, the source's first, with their normals in the target's
    frame, and which were looked at and agree."""

    points: Array
    normals: Array
    looked: NDArray[np.bool_]
    agrees: NDArray[np.bool_]


def compared(views: Views, agreement: Agreement) -> Compared:
    """`in_target`, both clouds in one."""
    rows = in_target(views, agreement)
    return Compared(
        points=np.concatenate([points for _, _, points, _ in rows]),
        normals=np.concatenate([normals for *_, normals in rows]),
        looked=np.concatenate([way.looked for _, way, *_ in rows]),
        agrees=np.concatenate([way.agrees for _, way, *_ in rows]),
    )


def compare(views: Views, T_target_source: Array, stride: int = 1) -> Agreement:
    """Agreement under one pose (4, 4), from every `stride`-th of each cloud's sampled points."""
    return compare_each(views, T_target_source[None], stride)[0]


def compare_each(views: Views, poses: Array, stride: int = 1) -> list[Agreement]:
    """The same for poses (b, 4, 4): on few points that takes a third of the time that one by one takes."""
    source, target, spacing = views.source, views.target, views.spacing
    rows_source, rows_target = source.asked[::stride], target.asked[::stride]
    forward = one_way(source, rows_source, target, poses, spacing)
    backward = one_way(target, rows_target, source, se3.inverse(poses), spacing)
    own = target.normals[rows_target]
    facing = (forward.normals, np.broadcast_to(own, (len(poses), *own.shape)))
    axes = main_axes(*facing)
    looked, agreed, through = np.zeros((3, len(poses), 3))
    for way, normals in zip((forward, backward), facing, strict=True):
        axis = faced(normals, axes)
        for k in range(3):
            faces = axis == k
            looked[:, k] += np.count_nonzero(faces & way.looked, axis=1)
            agreed[:, k] += np.count_nonzero(faces & way.looked & way.agrees, axis=1)
            through[:, k] += np.count_nonzero(faces & way.free, axis=1)
    return [
        Agreement(
            source=forward.of(row),
            target=backward.of(row),
            axes=axes[row],
            looked=stride * looked[row],
            agreed=stride * agreed[row],
            through=stride * through[row],
            relief=_relief(views, T, stride),
            overturned=overturned(source, target, T),
        )
        for row, T in enumerate(poses)
    ]


def _relief(views: Views, T: Array, stride: int) -> Alike:
    found = alike(views.source.relief, views.target.relief, T, stride)
    return beyond(found, views.relief_repeats) if found.information > _SPEAKS else found


def one_way(a: View, rows: NDArray[np.int64], b: View, T_b_a: Array, spacing: float) -> OneWay:
    """Rows (m,) of `a` in the frame of `b`, under each of some poses (b, 4, 4); the fields have a row for each pose."""
    moved = se3.apply(T_b_a, a.points[rows])
    normals = a.normals[rows] @ np.swapaxes(T_b_a[:, :3, :3], 1, 2)
    limit = _COVERED if b.image is not None else _SURROUNDED
    threads = query_threads(moved.size // 3)
    distance, match = b.tree.query(moved, distance_upper_bound=limit * spacing, workers=threads)
    covered: Mask = np.asarray(distance) < _COVERED * spacing
    row = np.where(covered, match, 0)
    other = b.normals[row]
    across = np.abs(np.einsum("bni,bni->bn", moved - b.points[row], other))
    parallel = np.abs(np.einsum("bni,bni->bn", normals, other)) > _SAME_NORMAL
    agrees = covered & (across < _ACROSS * spacing) & parallel
    if b.image is None:
        looked = np.isfinite(distance)
        free = hidden = np.zeros(looked.shape, dtype=bool)
    else:
        flat = moved.reshape(-1, 3), normals.reshape(-1, 3)
        state = b.image.look(*flat, margin=_MARGIN * spacing, reach=_REACH * spacing).reshape(covered.shape)
        free, hidden = state == Seen.FREE, state == Seen.HIDDEN
        looked = free | (state == Seen.SEEN)
    return OneWay(
        looked=looked,
        free=free,
        hidden=hidden,
        covered=covered,
        agrees=agrees,
        match=np.where(covered, match, -1).astype(np.int64),
        moved=moved,
        normals=normals,
    )
