# SPDX-License-Identifier: MIT
"""The five slots of a pipeline, and what a stage of each returns: it conforms by its signature, without importing
anything.

A stage may also carry `needs` and `gives`, sets of the words below, so that a pipeline can refuse stages that do not
fit when it is built: "image", "matches", "group".
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Overlap, Pose
from hybridreg.scene import Scene

SLOTS = ("downsample", "overlap", "match", "estimate", "refine")
_STEPS = ("prior", *SLOTS, "verdict")


# By how much a pose's rotation may be off before that is told: from float32, or a motion that drifted; by hand.
_NO_ROTATION = 1e-2
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


def in_order(step: str) -> int:
    """Where a step of a registration comes, by which its seconds are told; last what is none."""
    return _STEPS.index(step) if step in _STEPS else len(_STEPS)


def checked(slot: str, stage: Any, value: Any, scene: Scene | None = None) -> Any:
    """The value that a stage returned.

    Raises
    ------
    ValueError
        It is of another type than the slot's, an overlap of another shape or out of [0, 1], or matches that are not
        finite or weigh less than nothing; the message names slot and stage and says what to return. A pose of another
        shape, or that is not finite, counts as none, which the reasons say; one that is no rigid motion is noted.
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
    if isinstance(value, Correspondences):
        check_matches(value, f"{slot}: {name} returned matches")
    if isinstance(value, Pose) and scene is not None:
        _check_pose(f"{slot}: {name}", value, cure, scene)
    return value


def check_matches(found: Correspondences, whose: str) -> None:
    """Refuse matches that are not finite or whose weights are negative; `whose` begins the message."""
    for part in ("source", "target", "weight"):
        width = 1 if part == "weight" else 3
        finite = np.isfinite(getattr(found, part).reshape(len(found), width)).all(axis=1)
        if not finite.all():
            raise ValueError(
                f"{whose} whose {part} is not finite in {np.count_nonzero(~finite)} of {len(found)} rows (the first is "
                f"row {int(np.argmin(finite))}); leave these out"
            )
    if (lightest := float(np.min(found.weight, initial=0.0))) < 0.0:
        raise ValueError(f"{whose} with a weight of {lightest:.3g}; weights must not be negative")


def _check_pose(whose: str, pose: Pose, cure: str, scene: Scene) -> None:
    T = np.asarray(pose.T)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        wrong = f"of shape {T.shape}" if T.shape != (4, 4) else "that is not finite"
        scene.note(f"{whose} returned a pose {wrong}, which counts as none; {cure}")
        scene.explanations.append(f"{whose} returned a pose {wrong}")
    elif pose.found and se3.off_rotation(T[:3, :3]) > _NO_ROTATION:
        scene.note(
            f"{whose} returned a pose whose upper left 3x3 block is no rotation; the nearest one was taken"
        )


def _told(value: Any) -> str:
    if value is None:
        return "nothing"
    shape = getattr(value, "shape", None)
    return f"{type(value).__name__}{'' if shape is None else f' of shape {tuple(shape)}'}"
