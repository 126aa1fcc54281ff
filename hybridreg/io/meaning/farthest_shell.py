# SPDX-License-Identifier: MIT
"""The sphere around the sensor on which simulators put the ends of rays that met nothing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.meaning.first_column import looked_at

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

_FEWEST, _LEAST = 20, 0.01  # points of the shell, and their share
_MOST = 0.95  # share from which the sphere is the thing that was seen
_SAME = 3e-4  # of a range, by which two that are the same may differ: digits of a text, single precision
_OTHERS = 5  # how many times as many as on any other range: rings on flat ground, radars
_THIN = 0.01  # of the range; a shell thinner than that is a ring on the ground
_NO_HIT = 1.0  # metres: the distance -1 stands for nothing met in mujoco 4.0.0's `mj_ray` and `mj_multiRay`
_WAYS = 100  # directions in which the outermost points are looked for
_TRIES = 30  # spheres through four of them


@dataclass(frozen=True, kw_only=True)
class Shell:
    """The ends of rays that met nothing: their distance from `centre` (3,), which of the points they are (N,), and
    whether all others are nearer."""

    reach: float
    centre: Array
    there: Flags
    farthest: bool = True


def farthest_shell(points: Array) -> Shell | None:
    """The sphere on which many of finite points (N, 3) lie, in all directions; None where there is none.

    It is the longest distance from the origin that occurs, or from another place where the cloud was moved there, or
    one metre from the origin, where a distance of -1 was multiplied by the ray's direction.
    """
    if len(points) < _FEWEST:
        return None
    ranges = _lengths(points)
    found = _about(points, ranges, np.zeros(3)) or _about(points, ranges, np.zeros(3), _NO_HIT)
    if found is not None:
        return found
    centre = _centre(points[looked_at(len(points))])
    return None if centre is None else _about(points - centre, _lengths(points - centre), centre)


def _lengths(away: Array) -> Array:
    with np.errstate(over="ignore"):
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", away, away)))


def _about(away: Array, ranges: Array, centre: Array, reach: float | None = None) -> Shell | None:
    farthest = reach is None
    reach = float(ranges.max()) if reach is None else reach
    if not np.isfinite(reach):
        return None
    there = ranges >= (1.0 - _SAME) * reach
    if not farthest:
        there &= ranges <= (1.0 + _SAME) * reach
    count = int(np.count_nonzero(there))
    if count < max(_FEWEST, _LEAST * len(away)) or count > _MOST * len(away):
        return None
    others = np.sort(ranges[~there])
    if farthest and others[0] > 0.5 * reach:  # it is no sensor's place
        return None
    several = count // _OTHERS
    if (others[several:] - others[: len(others) - several] <= _SAME * others[several:]).any():
        return None
    shell = away[there] - away[there].mean(axis=0)
    if np.linalg.eigvalsh(shell.T @ shell / count)[0] < (_THIN * reach) ** 2:
        return None
    return Shell(reach=float(np.median(ranges[there])), centre=centre, there=there, farthest=farthest)


def _centre(some: Array) -> Array | None:
    """The centre of the sphere on which most of the outermost of some points lie; None where they lie on none."""
    middle = some.mean(axis=0)
    away = some - middle
    rng = np.random.default_rng(0)
    ways = rng.normal(size=(3, _WAYS))
    outer = away[np.unique((away @ ways).argmax(axis=0))]
    if len(outer) < _FEWEST:
        return None
    # |p|^2 = 2 c p + (r^2 - |c|^2): four points give c and r.
    left, right = np.column_stack([2.0 * outer, np.ones(len(outer))]), np.einsum("ij,ij->i", outer, outer)
    best = np.zeros(len(outer), dtype=bool)
    for _ in range(_TRIES):
        four = rng.choice(len(outer), 4, replace=False)
        try:
            on = _on(np.linalg.solve(left[four], right[four]), outer)
        except np.linalg.LinAlgError:
            continue
        best = on if on.sum() > best.sum() else best
    if 2 * best.sum() <= len(outer):
        return None
    solved = np.linalg.lstsq(left[best], right[best], rcond=None)[0]
    return np.asarray(middle + solved[:3])


def _on(solved: Array, outer: Array) -> Flags:
    squared = solved[3] + solved[:3] @ solved[:3]
    if not squared > 0.0:
        return np.zeros(len(outer), dtype=bool)
    return np.asarray(np.abs(np.linalg.norm(outer - solved[:3], axis=1) / np.sqrt(squared) - 1.0) <= _SAME)
