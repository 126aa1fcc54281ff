# SPDX-License-Identifier: MIT
"""Truths that the clouds contradict: a pose called "ok" covers far more of the source than the pose said to be true."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from hybridreg.config.number_of import number_of
from hybridreg.data.lists.direction import far_better
from hybridreg.data.yaw_starts import start_of
from hybridreg.eval.run.row import Row
from hybridreg.eval.score import metrics
from hybridreg.geometry import se3

Array = NDArray[np.float64]

# Degrees, and radii of the overlap, within which two poses agree; by hand.
_DEGREES, _RADII = 1.0, 1.0
# Pairs that are named, at most.
_NAMED = 5

# What may have been done to a truth (4, 4), and what then agrees with the pose found.
_MISTAKES: tuple[tuple[str, Callable[[Array], Array]], ...] = (
    ("inverted: do they map target to source?", se3.inverse),
    ("once their translations are divided by 1000: are they in millimetres?", lambda T: _shrunk(T, 1000.0)),
    ("once their translations are divided by 100: are they in centimetres?", lambda T: _shrunk(T, 100.0)),
    ("once their translations are multiplied by 1000: are they in kilometres?", lambda T: _shrunk(T, 0.001)),
    (
        "once their translations are multiplied by 0.3048: are they in feet?",
        lambda T: _shrunk(T, 1.0 / 0.3048),
    ),
    ("with x mirrored: is the frame of their tool left-handed?", lambda T: _mirrored(T, 0)),
    ("with y mirrored: is the frame of their tool left-handed?", lambda T: _mirrored(T, 1)),
    ("with z mirrored: is the frame of their tool left-handed?", lambda T: _mirrored(T, 2)),
)


def remarks(rows: Sequence[Row]) -> list[str]:
    """A sentence that names the pairs of all methods' rows whose truth is contradicted, and a likely cause; empty where
    none is."""
    doubted = [row for row in rows if _contradicts(row)]
    names = list(dict.fromkeys(row.id for row in doubted))
    if not doubted:
        return []
    lie, truly = (np.median([getattr(row, key) for row in doubted]) for key in ("overlap_found", "overlap"))
    told = ", ".join(names[:_NAMED]) + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")
    n = number_of(len({row.id for row in rows}), "pair")
    return [
        f"Are the true poses right? Under a pose called ok {lie:.0%} of the source lie on the target, under the true "
        f"one {truly:.0%}, in {len(names)} of {n}: {told}. {_cause(rows, doubted)}"
    ]


def _contradicts(row: Row) -> bool:
    if row.verdict != "ok" or row.overlap is None or row.overlap_found is None:
        return False
    return bool(far_better(np.array(row.overlap_found), np.array(row.overlap)))


def _cause(rows: Sequence[Row], doubted: Sequence[Row]) -> str:
    truths = {row.index: np.array(row.T_true) for row in rows if row.T_true is not None}
    if all(not T[:3, 3].any() for T in truths.values()):
        return "All of them are without a translation: were they filled in?"
    plain = [row for row in doubted if start_of(row.id) == row.id] or doubted
    for words, undo in _MISTAKES:
        if 2 * sum(_agree(row, undo(truths[row.index])) for row in plain) > len(plain):
            return f"Most of these agree with those poses {words}"
    for step, words in ((1, "after"), (-1, "before")):
        others = [(row, truths.get(row.index + step)) for row in plain]
        if 2 * sum(T is not None and _agree(row, T) for row, T in others) > len(plain):
            return f"Most of those poses agree with the truth of the pair {words}: is the list shifted?"
    return "Look at one of them: hybridreg view, or laid on one another by its true pose"


def _agree(row: Row, T: Array) -> bool:
    found = np.array(row.T)
    return bool(
        metrics.rre_deg(found, T) < _DEGREES
        and metrics.rte_m(found, T) < _RADII * (row.overlap_radius or 0.0)
    )


def _shrunk(T: Array, times: float) -> Array:
    return se3.from_rt(T[:3, :3], T[:3, 3] / times)


def _mirrored(T: Array, axis: int) -> Array:
    S = np.eye(4)
    S[axis, axis] = -1.0
    return np.asarray(S @ T @ S)
