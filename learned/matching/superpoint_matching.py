# SPDX-License-Identifier: MIT
"""Superpoint matching by feature distance with dual normalisation (docs/methods.md 7.3)."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from hybridreg.learned.layers.distances import squared_distances


@dataclass(frozen=True)
class SuperpointMatches:
    """Superpoint pairs, best first; one superpoint may occur in several."""

    target: Tensor  # (K,) int64
    source: Tensor  # (K,) int64
    score: Tensor  # (K,) in (0, 1]

    def __len__(self) -> int:
        return len(self.score)


def match_superpoints(
    target: Tensor,
    source: Tensor,
    n_matches: int,
    *,
    dual: bool = True,
    temperature: float = 1.0,
    votes: Tensor | None = None,
) -> SuperpointMatches:
    """The ``n_matches`` largest of ``exp(-|f - g|^2)``, normalised along rows and columns if ``dual``.

    Parameters
    ----------
    target, source
        (m, c), (n, c) features of length one.
    n_matches
        At most; fewer when there are fewer pairs.
    votes
        (m, n) logarithms that are added to those of the scores; the best pair then has score 1.
    """
    scores = torch.exp(-squared_distances(target, source, unit=True) / temperature)
    if dual:
        scores = (scores / scores.sum(1, keepdim=True)) * (scores / scores.sum(0, keepdim=True))
    if votes is not None:
        scores = scores.clamp_min(torch.finfo(scores.dtype).tiny).log() + votes
        scores = (scores - scores.max()).exp() if scores.numel() else scores
    score, index = scores.flatten().topk(min(n_matches, scores.numel()))
    columns = max(1, source.shape[0])
    return SuperpointMatches(index.div(columns, rounding_mode="floor"), index % columns, score)
