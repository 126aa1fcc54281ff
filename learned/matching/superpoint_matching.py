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
    unit: bool = True,
    votes: Tensor | None = None,
) -> SuperpointMatches:
    """The ``n_matches`` largest of ``exp(-|f - g|^2)``, normalised along rows and columns if ``dual``.

    Parameters
    ----------
    target, source
        (m, c), (n, c) features.
    n_matches
        At most; fewer when there are fewer pairs.
    unit
        All features have length one. Else distances may be of any size, their exponentials vanish, and it is the
        logarithms that are compared.
    votes
        (m, n) logarithms that are added to those of the scores; of unit features the best pair then has score 1.
    """
    if unit:
        scores = _scores(target, source, dual, temperature, votes)
        score, index = scores.flatten().topk(min(n_matches, scores.numel()))
    else:
        logits = _logits(target, source, dual, temperature)
        logits = logits if votes is None else logits + votes
        score, index = logits.flatten().topk(min(n_matches, logits.numel()))
        score = score.exp()
    columns = max(1, source.shape[0])
    return SuperpointMatches(index.div(columns, rounding_mode="floor"), index % columns, score)


def _scores(target: Tensor, source: Tensor, dual: bool, temperature: float, votes: Tensor | None) -> Tensor:
    scores = torch.exp(-squared_distances(target, source, unit=True) / temperature)
    if dual:
        scores = (scores / scores.sum(1, keepdim=True)) * (scores / scores.sum(0, keepdim=True))
    if votes is not None:
        scores = scores.clamp_min(torch.finfo(scores.dtype).tiny).log() + votes
        scores = (scores - scores.max()).exp() if scores.numel() else scores
    return scores


def _logits(target: Tensor, source: Tensor, dual: bool, temperature: float) -> Tensor:
    logits = (
        -(torch.cdist(target, source, compute_mode="donot_use_mm_for_euclid_dist").square()) / temperature
    )
    return logits.log_softmax(1) + logits.log_softmax(0) if dual and logits.numel() else logits
