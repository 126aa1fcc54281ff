# SPDX-License-Identifier: MIT
"""What the stage of a slot must return."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg import fitting
from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.scene import Scene
from hybridreg.slots import check_matches

Array = NDArray[np.float64]

# Spacings within which a match lies at some point of its cloud.
_AT_A_POINT = 2.0


def valid(out: Any, slot: str, scene: Scene, promised: Collection[str] = ()) -> None:
    """Assert that a stage of a slot returned what it must: the type, shapes, finite numbers, and what it `promised`."""
    if slot == "downsample":
        assert isinstance(out, Scene), f"returned {type(out).__name__}, not a Scene"
        other = fitting.changed(out, scene.pair)
        assert other is None, f"{other}: the pair of the scene is another one than was given"
        for side, level in (("source", out.source), ("target", out.target)):
            assert level.points.ndim == 2, f"{side}: points of shape {level.points.shape}, expected (n, 3)"
            assert level.points.shape[1] == 3, (
                f"{side}: points of shape {level.points.shape}, expected (n, 3)"
            )
            assert len(level) > 0, f"{side}: no point is left"
            assert level.spacing > 0, f"{side}: the spacing must be a positive length"
    elif slot == "overlap":
        for side, level in (("source", scene.source), ("target", scene.target)):
            p = getattr(out, side)
            assert p.shape == (len(level),), f"{side} has shape {p.shape}, expected ({len(level)},)"
            assert ((p >= 0) & (p <= 1)).all(), f"{side} holds values outside [0, 1]"
    elif slot == "match":
        assert isinstance(out, Correspondences), f"returned {type(out).__name__}, not Correspondences"
        check_matches(out, "returned matches")
        assert "group" not in promised or out.group is not None, "promises groups and gives none"
        for side, level in (("source", scene.source), ("target", scene.target)):
            found = getattr(out, side)
            far = _AT_A_POINT * max(out.spacing or 0.0, level.spacing)
            off = float(np.median(level.tree.query(found)[0])) if len(found) else 0.0
            assert off < far, (
                f"the matches' {side} lies {off:.2g} m off the {side}'s points; are the clouds swapped?"
            )
    else:
        assert isinstance(out, Pose), f"returned {type(out).__name__}, not a Pose"
        se3.check(np.asarray(out.T, dtype=np.float64))


def same(a: Any, b: Any) -> None:
    """Assert that two returned values are equal to the bit."""
    for x, y in zip(_arrays(a), _arrays(b), strict=True):
        assert np.array_equal(x, y, equal_nan=True), "two equal runs differ"


def _arrays(out: Any) -> list[Array]:
    if isinstance(out, Scene):
        return [out.source.points, out.target.points]
    if isinstance(out, Overlap):
        return [out.source, out.target]
    if isinstance(out, Correspondences):
        return [out.source, out.target, out.weight]
    return [out.T]


def error_m(A: Array, B: Array, scene: Scene) -> float:
    """Mean distance in metres of the source's points under two poses (4, 4)."""
    return float(
        np.linalg.norm(se3.apply(A, scene.source.points) - se3.apply(B, scene.source.points), axis=1).mean()
    )
