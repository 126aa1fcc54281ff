# SPDX-License-Identifier: MIT
"""Pose by correlation from above: both clouds levelled by their ground, at every yaw and shift."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hybridreg.classical.overhead.overhead_columns import FromAbove, from_above
from hybridreg.classical.overhead.planar_climb import climb
from hybridreg.classical.overhead.sweep import sweep
from hybridreg.evidence.log_odds import OK_LOG_ODDS
from hybridreg.geometry import se3
from hybridreg.geometry.ground import Ground
from hybridreg.matches import Correspondences, Pose
from hybridreg.resolution import map_cell
from hybridreg.scene import SIDES, Level, Scene, Side
from hybridreg.search.hypothesis import Found, Hypothesis, as_pose
from hybridreg.search.ranking import BEYOND_DOUBT, best, distinct
from hybridreg.search.settle import best_first
from hybridreg.stage import Stage

Array = NDArray[np.float64]

# Cell of the coarse map, voxels; by hand.
_COARSE = 3.0
# Farthest points from the sensor that are used, voxels: two such clouds fit in the largest map.
_REACH = 175.0
# Degrees between yaws; by hand.
_YAW_STEP_DEG = 4.0
# Share of the best peak's score that a peak needs: the walls of a corridor outvote what tells places apart; by hand.
_SHARE = 0.5
# Exponents by which the spectra are whitened: at first by half, so that the few objects on a field count beside a wall
# or a wood, and not at all when no pose stands out then; by hand.
_LEVELLED = (0.5, 0.0)
# Peaks examined first; the others only where none of these is beyond doubt; by hand.
_FIRST = 10
# Log-odds of the best pose of the run below which no other spectrum finds the right one: of the pairs of `sim:val` and
# `sim:train` that another spectrum solved, the best pose before had -3.3 at least.
_LOST = -5.0
# Degrees between a ground and its sensor's xy-plane from which it leans; of 240 level simulated scans 8 % have more.
_LEANS_DEG = 5.0
# Degrees of tilt from which a sensor is upside down; by hand.
_UPTURNED_DEG = 140.0


@dataclass(frozen=True, kw_only=True)
class BirdsEye(Stage):
    """Search all yaws and shifts on the ground, for sensors whose tilt follows from the ground.

    Both clouds are levelled by their ground (`hybridreg.geometry.ground`) and projected from above in layers of
    height. Columns occupied in both count for a pose, columns that are free space in one and occupied in the other
    count a little against it. The correlation is computed by FFT for every yaw on a coarse grid, its best peaks are
    improved on a fine one, and the best of these are settled on the surfaces and ranked by their log-odds. The height
    follows from the two ground planes. The others are returned as `rivals`.

    Where a cloud shows no ground, its sensor is assumed to stand upright (or upside down, if the other one does) and
    its lowest points to be the ground; a note says so.

    Parameters
    ----------
    vertical : "ground", "sensor" or "both"
        What levels the clouds: the ground that each shows, however its sensor was mounted; the z axes of both sensors,
        for those that stand upright and show a wall, a ceiling or sloping ground; or the ground first, and the sensors
        where that leaves no pose beyond doubt and a ground leans (a plane with many points may be a wall).
    voxel : float or None
        Resolution, metres; None takes 0.5, less where the clouds reach less than 30 m.
    layers : tuple of float
        Borders of the height layers over the ground, in voxels, rising.
    farthest : float
        Largest distance between the sensors along the ground, in voxels.
    tries : int
        Poses settled and ranked, at most.
    again : bool
        Search a second time, with another spectrum, where no pose stands out at first; where one does but is not
        beyond doubt, look along the street, and from its other end.
    """

    vertical: Literal["ground", "sensor", "both"] = "ground"
    voxel: float | None = None
    layers: tuple[float, ...] = (0.6, 2.0, 4.0, 8.0, 20.0)
    farthest: float = 120.0
    tries: int = 40
    again: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.voxel is not None and not 0.0 < self.voxel < np.inf:
            raise ValueError(f"voxel={self.voxel} must be a positive length in metres")
        if len(self.layers) < 2 or not (np.diff(self.layers) > 0.0).all():
            raise ValueError(f"layers={self.layers} must be two or more rising heights in voxels")
        if not 0.0 < self.farthest < np.inf:
            raise ValueError(f"farthest={self.farthest} must be a positive number of voxels")
        if self.tries < 1:
            raise ValueError(f"tries={self.tries} must be at least 1")

    def __call__(self, scene: Scene, matches: Correspondences, rng: np.random.Generator) -> Pose:
        voxel = self.voxel or map_cell(scene.pair.source, scene.pair.target)
        own = scene.at(voxel)
        found: list[Hypothesis] = []
        for frames in self._levelled(own, scene):
            found = best([*found, *self._laid(scene, own, frames, voxel)])
            if found and found[0].log_odds >= OK_LOG_ODDS:
                break
        if not found:
            scene.note("bird's-eye search: nothing but ground")
            return Pose.unknown()
        return as_pose(distinct(scene, found))

    def _levelled(self, own: Scene, scene: Scene) -> Iterator[Sequence[Array]]:
        if self.vertical != "sensor":
            as_shown = {side: own.level(side).ground for side in SIDES}
            other = [side for side in SIDES if own.grounds[side] is not as_shown[side]]
            for side in other:
                scene.note(
                    f"bird's-eye search: the {side} shows floor and ceiling, both sensors are taken to be upright; "
                    'if one hangs upside down, say so: gravity="unknown" (--gravity unknown)'
                )
            yield _by_ground(own, scene, own.grounds)
            if other:
                yield _by_ground(own, scene, as_shown)
        if self.vertical == "sensor" or (self.vertical == "both" and _leans(own)):
            yield _by_sensor(own)

    def _laid(self, scene: Scene, own: Scene, frames: Sequence[Array], voxel: float) -> list[Hypothesis]:
        # The best poses with each cloud levelled by one frame (T_level_source, T_level_target).
        T_level_source, T_level_target = frames
        source, target = (self._view(own, s, T, voxel) for s, T in zip(SIDES, frames, strict=True))
        if len(source.filled.layer) == 0 or len(target.filled.layer) == 0:
            return []
        found = self._searched(scene, source, target, voxel, frames)
        if not self.again or not found or not OK_LOG_ODDS <= found[0].log_odds < BEYOND_DOUBT:
            return found
        # A street looks alike from its other end and farther along: what could be mistaken for the pose must be known.
        T_level_source = _centred(T_level_target @ found[0].T, own.source.centre)
        along = self._slid(self._view(own, "source", T_level_source, voxel), target, voxel)
        return found + best_first(scene, _unlevelled(along, (T_level_source, T_level_target)))

    def _searched(
        self, scene: Scene, source: FromAbove, target: FromAbove, voxel: float, frames: Sequence[Array]
    ) -> list[Hypothesis]:
        found: list[Hypothesis] = []
        for levelled in _LEVELLED[: None if self.again else 1]:
            poses = _unlevelled(self._planar(source, target, voxel, levelled), frames)
            for some, plain in ((poses[:_FIRST], BEYOND_DOUBT), (poses[_FIRST:], OK_LOG_ODDS)):
                found = best([*found, *best_first(scene, some)])
                if found and found[0].log_odds >= plain:
                    return found
            if Found.of(scene).highest < _LOST:
                return found
        return found

    def _view(self, own: Scene, side: Side, T_level_cloud: Array, voxel: float) -> FromAbove:
        level = own.level(side)
        points = se3.apply(T_level_cloud, level.points)
        place = level.viewpoint if level.viewpoint is not None and level.viewpoint.ndim == 1 else None
        eye = None if place is None else se3.apply(T_level_cloud, place[None])[0]
        near = np.hypot(*points[:, :2].T) < _REACH * voxel
        return from_above(points[near], eye, tuple(voxel * edge for edge in self.layers), voxel)

    def _planar(self, source: FromAbove, target: FromAbove, voxel: float, whiten: float) -> list[Array]:
        peaks = sweep(
            source,
            target,
            cell=_COARSE * voxel,
            yaws=np.arange(0.0, np.pi, np.radians(_YAW_STEP_DEG)),
            farthest=self.farthest * voxel,
            most=self.tries,
            share=_SHARE,
            whiten=whiten,
        )
        found = climb(
            source, target, peaks, cell=voxel, step_deg=0.4 * _YAW_STEP_DEG, step=0.5 * _COARSE * voxel
        )
        return found.matrices

    def _slid(self, source: FromAbove, target: FromAbove, voxel: float) -> list[Array]:
        """Poses at the yaw that the views have, and half a turn from it: what lies along a street or a corridor decides
        where, and only a fine map shows it."""
        if len(source.filled.layer) == 0:
            return []
        peaks = sweep(
            source,
            target,
            cell=voxel,
            yaws=np.zeros(1),
            farthest=self.farthest * voxel,
            most=_FIRST,
            share=0.0,
            whiten=_LEVELLED[0],
        )
        return peaks.matrices


def _unlevelled(motions: Sequence[Array], frames: Sequence[Array]) -> list[Array]:
    # Motions along the ground as T_target_source.
    T_level_source, T_level_target = frames
    T_target_level = se3.inverse(T_level_target)
    return [T_target_level @ M @ T_level_source for M in motions]


def _centred(T_level_cloud: Array, place: Array) -> Array:
    # The same turn and heights, with a place (3,) of the cloud on the axis that the maps turn about.
    R, t = T_level_cloud[:3, :3], T_level_cloud[:3, 3]
    return se3.from_rt(R, t - (R @ place + t) * [1.0, 1.0, 0.0])


def _by_ground(own: Scene, scene: Scene, found: dict[Side, Ground | None]) -> list[Array]:
    # What levels each cloud by the ground found for it, or by what may be the ground instead.
    frames = []
    for side, other in zip(SIDES, reversed(SIDES), strict=True):
        shown, known = found[side], found[other]
        level = own.level(side)
        if shown is None:
            head_down = known is not None and known.up[2] < np.cos(np.radians(_UPTURNED_DEG))
            shown = _assumed(level.points, -1.0 if head_down else 1.0)
            scene.note(
                f"bird's-eye search: no ground found in the {side}; its sensor is assumed to be "
                f"{'upside down, as the other is' if head_down else 'upright'}"
            )
        frames.append(_level_frame(shown, level))
    return frames


def _leans(own: Scene) -> bool:
    # Else a search by the sensors would repeat the one by the grounds.
    grounds = (own.source.ground, own.target.ground)
    return any(ground is not None and ground.up[2] < np.cos(np.radians(_LEANS_DEG)) for ground in grounds)


def _by_sensor(own: Scene) -> list[Array]:
    return [_level_frame(_assumed(level.points, 1.0), level) for level in (own.source, own.target)]


def _assumed(points: Array, sign: float) -> Ground:
    up = np.array([0.0, 0.0, sign])
    return Ground(up, float(np.quantile(points @ up, 0.02)))


def _level_frame(g: Ground, level: Level) -> Array:
    return _centred(se3.from_rt(g.levelling, np.array([0.0, 0.0, -g.height])), level.centre)
