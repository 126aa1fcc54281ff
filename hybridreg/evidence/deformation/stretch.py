# SPDX-License-Identifier: MIT
"""Does the source fit better when it is stretched, or sheared, along the ground, or when its heights are?

No rigid pose is right then, and the best one is a compromise: of a source stretched by 5 % nearly all points find a
neighbour, and its middle may lie a metre from where it belongs. Scans taken in motion, maps that drift, axes with
factors of their own and heights in another unit are strained so. Of heights small strains do not count: most points
lie on the ground, and those of right poses often fit best when they are strained by several per cent.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence.deformation.deformed import Onto, fit
from hybridreg.evidence.surface_distance import closeness
from hybridreg.evidence.views import Views
from hybridreg.geometry import se3
from hybridreg.resolution import tolerance

Array = NDArray[np.float64]

# Nats per point that it must gain over any pose near by, and tolerances by which it must move the farther points, those
# beyond so many per cent of the others: by hand. Of 70 right poses, real and of `sim:val`, none gains more than 0.09.
_GAIN = 0.1
_HARM = 0.6
_FARTHER = 90.0
# Share of the greater strain from which the lesser makes them a size; by hand.
_ALIKE = 0.5
# Factors beyond this are no strain of a scan; by hand.
_MOST = 0.15
# Factors of the heights within this are none. Of 18 right poses of real pairs none is strained by more than 0.05; of
# 122 others (`sim:val`, hard kinds with even seeds) half are, and three of them, strained by more than 0.15, lie more
# closely by `_GAIN` for that: in a tunnel, on a field, and in a map that holds its place twice.
_HEIGHTS = 0.07
# Factors beyond this, or below one over it, lay a field flat: no unit of heights differs so much; by hand.
_TALLEST = 3.5


class Stretch(NamedTuple):
    """`factor` by which the source must be stretched along a `direction` (3,) of the target to fit best, level or
    upright, and the one `across` it on the level."""

    factor: float
    direction: Array
    across: float

    @property
    def is_size(self) -> bool:
        """Whether it is much the same along every direction."""
        most, least = self.factor - 1.0, self.across - 1.0
        return bool(least / most > _ALIKE)


def stretch(
    views: Views, T_target_source: Array, close: float, explained: Callable[[Array], bool]
) -> Stretch | None:
    """The stretch about a pose (4, 4) whose closeness is `close`; None where it fits hardly better, where that is
    `explained` otherwise, or where neither cloud shows its ground."""
    up = _up(views, T_target_source)
    if up is None:
        return None
    upright = np.outer(up, up)[None]
    for strains, read, tries in ((_level(up), _along_the_ground, 2), (upright, _of_heights, 1)):
        start = T_target_source
        for _ in range(tries):
            fitted = fit(Onto.target(views), start, strains).T
            found = read(views, up, fitted)
            if found is None:
                break
            if _is_better(views, T_target_source, close, fitted) and not explained(fitted):
                return found
            # Far points may have found no partners, and the fit stopped half-way: on from twice the strain.
            start = fitted @ np.linalg.inv(T_target_source) @ fitted
    return None


def _is_better(views: Views, T: Array, close: float, fitted: Array) -> bool:
    # Than the pose, and than any near by.
    enough = closeness(views.fine, fitted) - _GAIN
    return enough >= close and enough >= closeness(views.fine, fit(Onto.target(views), T).T)


def _along_the_ground(views: Views, up: Array, fitted: Array) -> Stretch | None:
    factors, directions = np.linalg.eigh(_strain(fitted))
    level = np.argsort(np.abs(up @ directions))[:2]
    k, across = level[np.argsort(-np.abs(factors[level] - 1.0))]
    most = abs(factors[k] - 1.0)
    if most > _MOST or most * _reach(views) < _HARM:
        return None
    return Stretch(float(factors[k]), directions[:, k], float(factors[across]))


def _of_heights(views: Views, up: Array, fitted: Array) -> Stretch | None:
    factor = float(up @ _strain(fitted) @ up)
    strained = abs(factor - 1.0) > _HEIGHTS and 1.0 / _TALLEST < factor < _TALLEST
    return Stretch(factor, up, 1.0) if strained else None


def _strain(fitted: Array) -> Array:
    # What is left (3, 3) of an affine map (4, 4) without its rotation.
    left = fitted[:3, :3] @ se3.project(fitted[:3, :3]).T
    return (left + left.T) / 2.0


def _reach(views: Views) -> float:
    # How far the farther points lie from the middle, in tolerances.
    pair = views.scene.pair
    radii = np.linalg.norm(views.source.points - views.middle, axis=1)
    return float(np.percentile(radii, _FARTHER)) / tolerance(pair.source, pair.target).metres


def _up(views: Views, T: Array) -> Array | None:
    if views.target.ground is not None:
        return views.target.ground.up
    return None if views.source.ground is None else T[:3, :3] @ views.source.ground.up


def _level(up: Array) -> Array:
    # Strains (3, 3, 3) within the plane that is level.
    a = np.cross(up, np.eye(3)[np.argmin(np.abs(up))])
    a /= np.linalg.norm(a)
    b = np.cross(up, a)
    return np.stack([np.outer(a, a), np.outer(b, b), np.outer(a, b) + np.outer(b, a)])
