# SPDX-License-Identifier: MIT
"""Which points the other sensor could have seen, as far as that is known before any pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry.extent import radii, reach
from hybridreg.geometry.range_image import RangeImage, RangeImages
from hybridreg.matches import Overlap
from hybridreg.scene import Scene, Side
from hybridreg.stage import Stage

Array = NDArray[np.float64]

# Share of a sensor's returns beyond its range or outside its vertical field of view, as defined here: outliers.
_STRAYS = 0.01
# Positions tried for the other sensor: rings of equal area at golden angles, so that few cover the disc evenly.
_N_PLACES = 24
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, kw_only=True)
class Visibility(Stage):
    """Probability that the other sensor, somewhere within `baseline` of this one, can see a point.

    For each point: the share of the possible positions of the other sensor from which the point lies within that
    sensor's range and, where both clouds show a ground, within its vertical field of view, at its own height
    over the ground. The range is that of its farthest returns, the field of view that of its range image about the
    normal of its own ground, so that a sensor may be mounted upside down or tilted.

    It does not know which way the other sensor faced (a narrow field of view excludes no direction; the probability is
    that of a point inside it), nor what was occluded. A cloud without a viewpoint, or with several, says nothing about
    what its sensor could see, so all points of the other cloud take part.

    Parameters
    ----------
    baseline : float or None
        How far apart the sensors may have stood, metres. None takes half the shorter of the clouds' extents
        (`hybridreg.geometry.extent.reach`).
    """

    baseline: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.baseline is not None and not 0.0 <= self.baseline < np.inf:
            raise ValueError(f"baseline={self.baseline} must be a length in metres, zero or more")

    def __call__(self, scene: Scene) -> Overlap:
        baseline = self.baseline
        if baseline is None:
            baseline = 0.5 * min(reach(radii(scene.source.points)), reach(radii(scene.target.points)))
        return Overlap(_reached(scene, "source", baseline), _reached(scene, "target", baseline))


def _reached(scene: Scene, side: Side, baseline: float) -> Array:
    other: Side = "target" if side == "source" else "source"
    level = scene.level(side)
    image: RangeImage | RangeImages | None = getattr(scene.pair, other).range_image
    # Sensors at several positions together see nearly everything around them.
    if not isinstance(image, RangeImage) or level.viewpoint is None or level.viewpoint.ndim > 1:
        return np.ones(len(level))
    farthest = float(np.quantile(image.ranges, 1.0 - _STRAYS))
    here, there = scene.grounds[side], scene.grounds[other]
    if here is None or there is None:
        return _within_range(level.points - level.viewpoint, farthest, baseline)
    up = here.above(level.points) - float(there.above(image.viewpoint[None])[0])
    return _within_view(level.points - level.viewpoint, up, here.up, image, there.up, farthest, baseline)


def _within_range(ray: Array, farthest: float, baseline: float) -> Array:
    # Without a vertical the disc may lie in any plane; the share is that of positions along the line through the
    # point, which depends on the distance alone.
    distance = np.linalg.norm(ray, axis=1)
    return np.clip((farthest + baseline - distance) / max(2.0 * baseline, 1e-9), 0.0, 1.0)


def _within_view(
    ray: Array, rise: Array, up: Array, image: RangeImage, up_other: Array, farthest: float, baseline: float
) -> Array:
    # `rise`: heights over the other sensor's eye, if both stand on one ground.
    low, high = np.quantile(image.directions @ up_other, [_STRAYS, 1.0 - _STRAYS])
    edges = np.arcsin(np.clip([low, high], -1.0, 1.0)) + image.resolution * np.array([-1.0, 1.0])
    low, high = np.sin(np.clip(edges, -0.5 * np.pi, 0.5 * np.pi))
    flat = ray - np.outer(ray @ up, up)
    seen = np.zeros(len(ray))
    for place in _places(up, baseline):
        distance = np.sqrt(np.sum((flat - place) ** 2, axis=1) + rise**2)
        sine = rise / np.maximum(distance, 1e-9)
        seen += (distance <= farthest) & (sine >= low) & (sine <= high)
    return seen / _N_PLACES


def _places(up: Array, radius: float) -> Array:
    across = np.linalg.svd(up[None])[2][1:]
    i = np.arange(_N_PLACES)
    r, turn = radius * np.sqrt((i + 0.5) / _N_PLACES), _GOLDEN * i
    return np.column_stack([r * np.cos(turn), r * np.sin(turn)]) @ across
