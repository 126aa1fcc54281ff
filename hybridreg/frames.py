# SPDX-License-Identifier: MIT
"""From the user's coordinates to the small ones that the stages see, and back."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.geometry import se3
from hybridreg.matches import Correspondences, Pose
from hybridreg.pair import Pair

Array = NDArray[np.float64]


def raise_pose(T: Array, pair: Pair) -> Array:
    """Pose between the user's coordinates, from a pose between the clouds minus their offsets."""
    raised = T.copy()
    raised[:3, 3] = T[:3, 3] + pair.target.offset - T[:3, :3] @ pair.source.offset
    return raised if pair.placed is None else pair.placed.raised(raised)


def raise_found(pose: Pose, pair: Pair) -> Array:
    """The same of a pose that was found; otherwise where the source lay before the search: at the given start, or as
    it came."""
    if pose.found:
        return raise_pose(pose.T, pair)
    return np.eye(4) if pair.placed is None else pair.placed.raised(np.eye(4))


def raise_target(points: Array, pair: Pair) -> Array:
    """Places (n, 3) of the target's frame in the user's coordinates."""
    raised = points + pair.target.offset
    return raised if pair.placed is None else se3.apply(se3.inverse(pair.placed.target), raised)


def raise_information(information: Array, pair: Pair) -> Array:
    """Information (6, 6) along the axes of the user's target, of one along those of the placed target."""
    if pair.placed is None:
        return information
    turn = np.kron(np.eye(2), pair.placed.target[:3, :3].T)
    turned: Array = turn @ information @ turn.T
    return turned


def lower_pose(T: Array, pair: Pair) -> Array:
    """The reverse of `raise_pose`."""
    T = T if pair.placed is None else pair.placed.lowered(T)
    lowered = T.copy()
    lowered[:3, 3] = T[:3, 3] - pair.target.offset + T[:3, :3] @ pair.source.offset
    return lowered


def raise_matches(matches: Correspondences, pair: Pair) -> Correspondences:
    """Matches in the user's coordinates."""
    source, target = matches.source + pair.source.offset, matches.target + pair.target.offset
    if pair.placed is not None:
        source = se3.apply(se3.inverse(pair.placed.source), source) / pair.placed.scale
        target = se3.apply(se3.inverse(pair.placed.target), target)
    return dataclasses.replace(matches, source=source, target=target)


def lower_matches(matches: Any, pair: Pair) -> Correspondences:
    """The user's own matches, in the form that the stages take.

    Parameters
    ----------
    matches : Correspondences in the user's coordinates, or (K, 2) integers
        Rows of source and target points.

    Raises
    ------
    ValueError
        Wrong shape or type, or a row that a cloud does not have.
    """
    if isinstance(matches, Correspondences):
        source, target = matches.source, matches.target
        if pair.placed is not None:
            source = se3.apply(pair.placed.source, source * pair.placed.scale)
            target = se3.apply(pair.placed.target, target)
        return dataclasses.replace(
            matches, source=source - pair.source.offset, target=target - pair.target.offset
        )
    rows = np.asarray(matches)
    if rows.ndim != 2 or rows.shape[1] != 2 or rows.dtype.kind not in "iu":
        raise ValueError(
            f"matches: expected Correspondences or integer rows of shape (K, 2), got {rows.dtype} {rows.shape}"
        )
    for column, name, cloud in ((0, "source", pair.source), (1, "target", pair.target)):
        if len(rows) and not (rows[:, column].min() >= 0 and rows[:, column].max() < len(cloud)):
            raise ValueError(
                f"matches: column {column} names rows {rows[:, column].min()} to {rows[:, column].max()}, "
                f"but the {name} has {len(cloud)} points"
            )
    return Correspondences.of(pair.source.points[rows[:, 0]], pair.target.points[rows[:, 1]])
