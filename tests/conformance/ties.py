# SPDX-License-Identifier: MIT
"""How far apart lists of indices and of matches are, ties forgiven and counted."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
import torch
from arrays import apart
from scipy.spatial import cKDTree
from torch import Tensor

# Relative to the larger of the two numbers that were compared; some ten units in the last place of float32.
TIE = 5e-6


@dataclass
class Compared:
    """Differences by output, each with its tolerance, and how many ties were forgiven."""

    values: dict[str, tuple[float, float]] = field(default_factory=dict)
    ties: dict[str, int] = field(default_factory=dict)

    def close(self, name: str, value: Tensor, want: Tensor, tolerance: float) -> None:
        """Largest absolute difference; infinity where the shapes differ."""
        # A tolerance that grows with the recorded numbers is none where these are not finite.
        finite = math.isfinite(tolerance)
        self.values[name] = (apart(value, want) if finite else math.inf, tolerance if finite else 0.0)

    def same(self, name: str, value: Tensor, want: Tensor) -> None:
        """Equal to the last bit."""
        self.values[name] = (0.0 if torch.equal(value.to(want.dtype), want) else math.inf, 0.0)

    def print_ties(self) -> None:
        """Say how many were forgiven."""
        for name, count in self.ties.items():
            print(f"{name}: {count} ties forgiven")

    def tied(self, name: str, differing: Tensor, gaps: Tensor, tolerance: float) -> None:
        """Entries that differ must differ by a tie: ``gaps`` at them are below ``tolerance``; they are counted."""
        count = int(differing.sum())
        if count:
            self.ties[name] = count
        worst = float(gaps[differing].max()) if count else 0.0
        self.values[name] = (worst, tolerance)


def rows_apart(ours: list[Tensor], theirs: list[Tensor], forgiven: int = 0) -> tuple[list[float], int]:
    """Differences of rows matched as a set, one to one, by the columns' blocks; and how many rows have no partner.

    At most ``forgiven`` rows may be without a partner, on either side (matches whose score lies at a threshold).
    """
    tables = [
        np.hstack([t.detach().numpy().reshape(len(t), -1) for t in tensors]).astype(np.float64)
        for tensors in (ours, theirs)
    ]
    distance, partner = _one_to_one(tables[0], tables[1])
    alone = distance > 1e-2
    used = np.unique(partner[~alone])
    lonely = int(alone.sum()) + len(tables[1]) - len(used)
    if lonely > forgiven or len(used) < int((~alone).sum()) - forgiven:
        return [math.inf] * len(ours), lonely
    difference = np.abs(tables[0] - tables[1][partner])[~alone]
    widths = np.cumsum([0, *(t[0].numel() if len(t) else 1 for t in ours)])
    return [float(difference[:, a:b].max(initial=0.0)) for a, b in itertools.pairwise(widths)], lonely


def _one_to_one(ours: np.ndarray, theirs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For each of our rows the nearest of theirs that is still free, among the nearest four: equal rows do occur."""
    near = min(4, len(theirs))
    if near == 0:
        return np.full(len(ours), np.inf), np.zeros(len(ours), dtype=np.int64)
    distance, rows = (a.reshape(len(ours), near) for a in cKDTree(theirs).query(ours, k=near))
    taken: set[int] = set()
    chosen = np.zeros(len(ours), dtype=np.int64)
    for i in np.argsort(distance[:, 0], kind="stable"):
        chosen[i] = next((k for k in range(near) if rows[i, k] not in taken), 0)
        taken.add(int(rows[i, chosen[i]]))
    at = np.arange(len(ours))
    return distance[at, chosen], rows[at, chosen]
