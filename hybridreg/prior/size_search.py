# SPDX-License-Identifier: MIT
"""The size of a source whose unit nobody knows: the one at which the clouds fit best."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hybridreg import spec
from hybridreg.evidence import views
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair
from hybridreg.prior.placing import sized
from hybridreg.resolution import comparable, size_ratio
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import seen_at
from hybridreg.verdict import weigh

Array = NDArray[np.float64]

# Sizes apart by so much still meet within a search's own tolerance; tried up to so many steps both ways.
_STEP, _STEPS = 1.12, 4
# Ratio of the clouds' reaches from which sizes around it are tried too, not only those around 1.
_UNLIKE = 1.4
# Poses that are tried at each size; sizes whose size is then fitted, and rounds of that.
_TRIES, _FITTED, _ROUNDS = 8, 3, 4
# Steps along which the closest size is then sought; and how far off the margin is looked at. Fitting with the pose is a
# half per cent too small, as partners are trimmed; the points' closeness has its peak at the right size (within 0.3 %
# on the demo pair and real ones).
_FINE, _ASIDE = (0.01, 0.005, 0.0025, 0.00125), 0.015


class Size(NamedTuple):
    """What to multiply the source by; and how much more closely the clouds lie at this size than 1.5 % beside it, nats
    per point."""

    scale: float = 1.0
    margin: float = 0.0


class _Tried(NamedTuple):
    scale: float
    value: float
    T: Array


def found(pair: Pair) -> Size:
    """The size of the source at which the clouds fit best; 1 with no margin where none fits.

    Sizes around 1, and around the ratio of what both clouds reach, are searched from above; the best are fitted along
    with the pose (point to plane, seven unknowns); of these the one of which the verdict is surest is taken, and moved
    to where the points lie most closely on the other cloud's surfaces.
    """
    tried = [each for scale in _sizes(pair) if (each := _searched(pair, scale)) is not None]
    best = sorted(tried, key=lambda each: -each.value)[:_FITTED]
    fitted_ones = [_at_its_best(pair, each) for each in best]
    if not fitted_ones:
        return Size()
    return _closest(pair, max(fitted_ones, key=lambda each: each.value))


def _sizes(pair: Pair) -> list[float]:
    ratio = size_ratio(pair.source, pair.target)
    centres = [1.0] if comparable(pair.source, pair.target) else []
    if abs(np.log(ratio)) > np.log(_UNLIKE):
        centres.append(ratio)
    steps = _STEP ** np.arange(-_STEPS, _STEPS + 1)
    return [float(centre * step) for centre in centres for step in steps]


def _scene(pair: Pair, scale: float) -> Scene:
    scene: Scene = spec.from_table("voxel", "downsample")(
        pair.replaced(source=sized(pair.source, scale), image=None)
    )
    return scene


def _searched(pair: Pair, scale: float) -> _Tried | None:
    scene = _scene(pair, scale)
    search = spec.from_table({"stage": "birdseye", "tries": _TRIES, "again": False}, "estimate")
    pose = search(scene, Correspondences.none(), np.random.default_rng(0))
    if not pose.found:
        return None
    return _Tried(scale, seen_at(scene, [pose.T], 1)[0].log_odds, pose.T)


def _refined(scene: Scene, T: Array) -> Array:
    refined: Array = spec.from_table("gicp", "refine")(scene, Pose(T)).T
    return refined


def _resized(scene: Scene, T: Array, factor: float) -> Array:
    # The source grows about the user's origin, while its middle stays where the pose puts it.
    middle = scene.pair.source.points.mean(axis=0)
    return se3.from_rt(T[:3, :3], T[:3, 3] - T[:3, :3] @ middle * (factor - 1.0))


def _at_its_best(pair: Pair, tried: _Tried) -> _Tried:
    """The size and pose after fitting, with the verdict's confidence."""
    scale, T = tried.scale, tried.T
    for _ in range(_ROUNDS):
        scene = _scene(pair, scale)
        T = _refined(scene, T)
        factor = PoseEvidence(views.of(scene), T).size.scale
        if factor == 1.0:
            break
        scale, T = scale * factor, _resized(scene, T, factor)
    return _Tried(scale, weigh(scene, Pose(T)).confidence, T)


def _closest(pair: Pair, start: _Tried) -> Size:
    def at(scale: float, T: Array) -> _Tried:
        scene = _scene(pair, scale)
        T = _refined(scene, T)
        return _Tried(scale, PoseEvidence(views.of(scene), T).closeness, T)

    def beside(one: _Tried, factor: float) -> _Tried:
        return at(one.scale * factor, _resized(_scene(pair, one.scale), one.T, factor))

    best = at(start.scale, start.T)
    for step in _FINE:
        best = max(
            best, beside(best, 1.0 + step), beside(best, 1.0 / (1.0 + step)), key=lambda one: one.value
        )
    aside = max(beside(best, 1.0 + _ASIDE).value, beside(best, 1.0 / (1.0 + _ASIDE)).value)
    return Size(best.scale, best.value - aside)
