# SPDX-License-Identifier: MIT
"""What a stage gave back, looked at before the next one gets it."""

from __future__ import annotations

from typing import Any

import numpy as np

from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.scene import Scene

# What a stage of each slot returns, and how a person makes one.
_KINDS: dict[str, tuple[type, str]] = {
    "downsample": (Scene, "hybridreg.Scene.on_cells(pair, 0.5) makes one"),
    "overlap": (
        Overlap,
        "hybridreg.Overlap(source, target) takes a probability for each point of the two levels",
    ),
    "match": (
        Correspondences,
        "hybridreg.Correspondences.of(source, target) takes two arrays (K, 3) of coordinates",
    ),
    "estimate": (Pose, "hybridreg.Pose(T) takes a (4, 4) matrix from source to target"),
    "refine": (Pose, "hybridreg.Pose(T) takes a (4, 4) matrix from source to target"),
}


def checked(slot: str, stage: Any, value: Any, scene: Scene | None = None) -> Any:
    """The value that a stage returned.

    Raises
    ------
    ValueError
        It is of another type than the slot's, or an overlap of another shape or out of [0, 1]; the message names slot
        and stage and says what to return. A pose of another shape is noted, and counts as none.
    """
    name = getattr(stage, "__name__", type(stage).__name__)
    kind, cure = _KINDS[slot]
    if not isinstance(value, kind):
        raise ValueError(f"{slot}: {name} returned {_told(value)} where {kind.__name__} is due; {cure}")
    if isinstance(value, Overlap) and scene is not None:
        for side, level in (("source", scene.source), ("target", scene.target)):
            found = np.asarray(getattr(value, side))
            if found.shape != (len(level),):
                raise ValueError(
                    f"{slot}: {name} returned an overlap of shape {found.shape} for the {len(level)} points of the "
                    f"{side}'s level; {cure}"
                )
            if not (
                np.isfinite(found).all() and found.min(initial=0.0) >= 0.0 and found.max(initial=0.0) <= 1.0
            ):
                raise ValueError(
                    f"{slot}: {name} returned an overlap of the {side} that leaves [0, 1] or is not finite; {cure}"
                )
    if isinstance(value, Pose) and scene is not None and np.shape(value.T) != (4, 4):
        scene.note(
            f"{slot}: {name} returned a pose of shape {np.shape(value.T)}, which counts as none; {cure}"
        )
    return value


def _told(value: Any) -> str:
    if value is None:
        return "nothing"
    shape = getattr(value, "shape", None)
    return f"{type(value).__name__}{'' if shape is None else f' of shape {tuple(shape)}'}"
