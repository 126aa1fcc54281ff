# SPDX-License-Identifier: MIT
"""Where a pose is not beyond doubt: would one fit the source's mirror image, or the source in another unit?"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg import spec
from hybridreg.cloud import PointCloud
from hybridreg.evidence.log_odds import OK
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair
from hybridreg.resolution import comparable, size_ratio
from hybridreg.scene import Scene
from hybridreg.search.hypothesis import as_hypotheses, as_pose
from hybridreg.search.ranking import HOPELESS
from hybridreg.search.settle import best_first
from hybridreg.verdict import weigh
from hybridreg.verdict.confidence import DOUBTED

Array = NDArray[np.float64]

# Metres of one unit, and its name.
_UNITS = ((0.001, "millimetres"), (0.01, "centimetres"), (0.3048, "feet"))
# Poses that are tried under a mistake: the right one is among the first where the clouds fit well; by hand.
_TRIES = 10
# What finds a place in views that show little ground.
_THOROUGH: tuple[dict[str, Any], ...] = ({"stage": "manhattan"}, {"stage": "kiss", "scale": 2.5})
# Extents of two clouds of one place, in one unit, mostly differ by less than this factor; by hand.
_ALIKE = 4.0


def explanations(scene: Scene, *, thorough: bool = False) -> list[str]:
    """Sentences for the mistakes under which the clouds fit: at most one, of those that make them "ok".

    The pose that was found may be as likely: a room that is nearly its own mirror image tells neither. `thorough`, for
    where that pose is "ok" or would be but for a bound: search further, and take what fits as well.
    """
    enough = DOUBTED if thorough else OK
    for side, factors, sentence in _changes(scene.pair):
        pair = replace(scene.pair, image=None)
        if side == "source":
            pair = replace(pair, source=_changed(pair.source, factors))
        else:
            pair = replace(pair, target=_changed(pair.target, factors))
        if _fit(pair, thorough) >= enough:
            return [sentence]
    return []


def _changes(pair: Pair) -> Iterator[tuple[str, Array, str]]:
    # Cloud, what its coordinates are multiplied by, and the sentence.
    ratio = size_ratio(pair.source, pair.target)
    for metres, unit in _UNITS:
        for factor, side in ((metres, "source"), (1.0 / metres, "target")):
            off = abs(np.log(ratio / factor))
            if off < np.log(_ALIKE) and off < abs(np.log(ratio)):
                yield (
                    side,
                    np.full(3, metres),
                    f"the clouds fit when the {side} is taken to be in {unit}: multiply its coordinates by {metres:g}",
                )
    if comparable(pair.source, pair.target):
        yield (
            "source",
            np.array([1.0, -1.0, 1.0]),
            "the source fits as its mirror image: was it exported left-handed? Change the sign of one axis",
        )


def _changed(cloud: PointCloud, factors: Array) -> PointCloud:
    seen = cloud.seen
    return PointCloud(points=cloud.points * factors, said=seen._replace(places=seen.places * factors))


def _fit(pair: Pair, thorough: bool) -> float:
    scene = spec.from_table("voxel", "downsample")(pair)
    tables: list[dict[str, Any]] = [{"stage": "birdseye", "tries": _TRIES, "again": False}]
    if thorough:
        tables.extend(_THOROUGH)
    poses = [pose for table in tables if (pose := _estimated(scene, table)) is not None]
    found = best_first(scene, [start for pose in poses for start in as_hypotheses(pose)[:_TRIES]])
    if not found or found[0].log_odds < HOPELESS:
        return 0.0
    return weigh(scene, as_pose(found)).confidence


def _estimated(scene: Scene, table: dict[str, Any]) -> Pose | None:
    try:
        pose: Pose = spec.from_table(table, "estimate")(
            scene, Correspondences.none(), np.random.default_rng(0)
        )
    except ImportError:
        return None
    return pose if pose.found else None
