# SPDX-License-Identifier: MIT
"""Poses that may be right, and what one run has found of them so far."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.evidence import log_odds, views
from hybridreg.evidence.pose_evidence import PoseEvidence
from hybridreg.matches import Pose
from hybridreg.scene import Scene

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, kw_only=True)
class Hypothesis:
    """A pose that may be right.

    Attributes
    ----------
    at : PoseEvidence
        The pose, and what both clouds say about it.
    by_surfaces : float
        Log-odds that it is right by the surfaces alone, perhaps from some of the sampled points.
    settled : bool
        It rests where the surfaces let it, or is too far behind for that to matter: it need not be settled again.
    found_by : int
        Entries that found it independently of one another.
    matched : float
        Share of matches that agree with it.
    closeness : float
        Its closeness less that of the closest hypothesis beside it, nats.
    came_from : str
        The entry that found it.
    """

    at: PoseEvidence
    by_surfaces: float
    settled: bool = False
    found_by: int = 1
    matched: float = 0.0
    closeness: float = 0.0
    came_from: str = ""

    @property
    def T(self) -> Array:
        """T_target_source (4, 4)."""
        return self.at.T

    @property
    def log_odds(self) -> float:
        """Log-odds that the pose is right, were there no other."""
        return self.by_surfaces + log_odds.beside(self.matched, self.closeness)

    def but(self, **facts: Any) -> Hypothesis:
        """The same pose with other facts."""
        return replace(self, **facts)


@dataclass(frozen=True, eq=False)
class Found:
    """What a run has found so far.

    Attributes
    ----------
    starts : every start, roughly settled
    settled : the best of these, settled closely but for those far behind, and what rests where it is
    """

    starts: list[Hypothesis] = field(default_factory=list)
    settled: list[Hypothesis] = field(default_factory=list)

    @classmethod
    def of(cls, scene: Scene) -> Found:
        """The record of a scene's run."""
        return scene.shared("found", cls)

    @property
    def highest(self) -> float:
        """Log-odds of the best settled pose; minus infinity before there is one."""
        return max((one.log_odds for one in self.settled), default=-np.inf)


def as_pose(found: Sequence[Hypothesis]) -> Pose:
    """The first of `found`, at least one, as a pose with the others as its rivals."""
    pose = Pose.ranked([one.T for one in found])
    return replace(pose, found_by=found[0].found_by, hypotheses=tuple(found))


def as_hypotheses(pose: Pose) -> list[Hypothesis | Array]:
    """A pose and its rivals: the hypotheses that they were made of, where nothing has moved them since, else (4, 4)."""
    poses = [pose.T, *pose.rivals]
    if len(pose.hypotheses) != len(poses):
        return list(poses)
    return [
        one if isinstance(one, Hypothesis) and np.array_equal(one.T, T) else T
        for one, T in zip(pose.hypotheses, poses, strict=True)
    ]


def of_pose(scene: Scene, pose: Pose) -> PoseEvidence:
    """Evidence for a pose: that of the hypothesis that it is, if it is one."""
    own = as_hypotheses(pose)[0]
    return own.at if isinstance(own, Hypothesis) else PoseEvidence(views.of(scene), own)


def parted(poses: Sequence[Array | Hypothesis]) -> tuple[list[Hypothesis], list[Array]]:
    """Those that are settled hypotheses, and the others as (4, 4)."""
    settled: list[Hypothesis] = []
    others: list[Array] = []
    for one in poses:
        if not isinstance(one, Hypothesis):
            others.append(one)
        elif one.settled:
            settled.append(one)
        else:
            others.append(one.T)
    return settled, others


def seen_at(
    scene: Scene, poses: Sequence[Array] | Array, stride: int, *, settled: bool = False
) -> list[Hypothesis]:
    """Hypotheses of poses (4, 4) where they are, from every `stride`-th of the sampled points."""
    both = views.of(scene)
    stacked = np.array(poses, dtype=np.float64).reshape(-1, 4, 4)
    values = log_odds.of_each(both, stacked, stride)
    return [
        Hypothesis(at=PoseEvidence(both, T), by_surfaces=value, settled=settled)
        for T, value in zip(stacked, values, strict=True)
    ]
