# SPDX-License-Identifier: MIT
"""The transport between the points of two patches: rows and columns are normalised alternately, the slack stays
free."""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional as F

MASKED = -1e6  # score of an empty slot


def alternating_sinkhorn(scores: Tensor, iterations: int) -> Tensor:
    """Scores (B, n, m) to log-assignments (B, n + 1, m + 1), the last row and column the slack (Yew and Lee 2020).

    The slack's scores are 0, not learned. Each iteration normalises every row except the slack's, including its slack
    entry, then every column except the slack's: a point may stay unmatched, but the slack has no mass to distribute.
    """
    padded = F.pad(scores, (0, 1, 0, 1))
    for _ in range(iterations):
        rows = padded[:, :-1] - padded[:, :-1].logsumexp(2, keepdim=True)
        padded = torch.cat([rows, padded[:, -1:]], 1)
        columns = padded[:, :, :-1] - padded[:, :, :-1].logsumexp(1, keepdim=True)
        padded = torch.cat([columns, padded[:, :, -1:]], 2)
    return padded


def either_best(assignment: Tensor) -> Tensor:
    """Which of the entries (B, n, m) of (B, n + 1, m + 1) are the best of their row or column, the slack's included."""
    found = torch.zeros_like(assignment, dtype=torch.bool)
    by_row = found.scatter(2, assignment.argmax(2, keepdim=True), True)
    by_column = found.scatter(1, assignment.argmax(1, keepdim=True), True)
    return (by_row | by_column)[:, :-1, :-1]
