# SPDX-License-Identifier: MIT
"""Poses that the caller has from elsewhere, and what the clouds say of them.

Odometry drifts, and a position by satellites is metres off: two links of one such source agree with one another whether
they are right or not. So each given pose is a start, from which its pair is registered.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.cloud import PointCloud
from hybridreg.evidence.log_odds import FAILED
from hybridreg.geometry import se3
from hybridreg.many.links import Link
from hybridreg.pair import Pair
from hybridreg.pipeline import Pipeline
from hybridreg.resolution import Tolerance, tolerance
from hybridreg.result import RegistrationResult

Array = NDArray[np.float64]

# Tolerances within which a given pose is expected to be right: by hand, two metres and eight degrees for vehicles.
_WITHIN = 4.0
# Share of either cloud that is visible to the other sensor, below which clouds cannot tell; by hand.
_SEEN = 0.05


def judged(
    source: int, target: int, moving: PointCloud, still: PointCloud, T: Array, pipeline: Pipeline, seed: int
) -> Link:
    """The link of two clouds whose pose (4, 4) was given.

    Where the clouds are "ok" near it, that pose, and else where they are "ok" without it; `off` tells how far away the
    given one lies. Where they are nowhere, the given one, "given", unless they contradict it.
    """
    pair = Pair.of(moving, still, id=f"{source}-{target}")
    allowed = tolerance(moving, still)
    given = Link(
        source=source,
        target=target,
        T_target_source=T,
        verdict="given",
        confidence=FAILED,
        metres=allowed.metres,
    )
    near = {"init": T, "max_translation": _WITHIN * allowed.metres, "max_rotation": _WITHIN * allowed.degrees}
    try:
        for method in (pipeline.swap(prior=near), pipeline):
            result = method.run(pair, seed=seed)
            if result.verdict == "ok":
                return _found(given, result, moving)
        verdict = Pipeline.preset("verify").swap(prior={"init": T}).run(pair, seed=seed)
    except ValueError:  # clouds of which one reaches a hundred times as far, for one
        return given
    seen = max(verdict.evidence["visible_source"], verdict.evidence["visible_target"])
    if verdict.verdict == "failed" and seen > _SEEN:
        return replace(given, verdict="failed", confidence=verdict.confidence)
    return given


def _found(given: Link, result: RegistrationResult, moving: PointCloud) -> Link:
    T = result.transformation
    centre = se3.apply(T, (np.median(moving.points, axis=0) + moving.offset)[None])[0]
    return replace(
        given,
        T_target_source=T,
        verdict=result.verdict,
        confidence=result.confidence,
        metres=result.tolerance.metres,
        rivals=result.rivals,
        off=Tolerance.between(T, given.T_target_source, centre),
    )


def is_row(value: Any, n: int) -> bool:
    """Whether it counts one of `n` clouds, from 0."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool) and 0 <= int(value) < n


def checked(rows: Any, T: Any, n: int) -> tuple[int, int, Array]:
    """Source, target and pose (4, 4) of one that was given, for `n` clouds.

    Raises
    ------
    ValueError
        No two rows, or no pose.
    """
    if not (isinstance(rows, tuple) and len(rows) == 2 and all(is_row(row, n) for row in rows)):
        raise ValueError(f"known: {rows} are no two rows of the {n} clouds")
    source, target = map(int, rows)
    if source == target:
        raise ValueError(f"known: {rows} are no two rows of the {n} clouds")
    return source, target, se3.check(T, f"known[{source}, {target}]")
