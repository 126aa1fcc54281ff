# SPDX-License-Identifier: MIT
"""Which superpoint pairs are kept for point matching."""

from __future__ import annotations

from typing import NamedTuple

from torch import Tensor

from hybridreg.learned.cofinet.config import SelectionConfig


class NodePairs(NamedTuple):
    """Superpoint pairs, ordered by source; one superpoint may occur in several."""

    source: Tensor  # (K,) int64
    target: Tensor  # (K,) int64
    confidence: Tensor  # (K,) probability of the coarse transport


class Tried(NamedTuple):
    """A threshold that was tried, and the number of pairs above it."""

    threshold: float
    pairs: int


def select(probability: Tensor, config: SelectionConfig) -> tuple[NodePairs, list[Tried]]:
    """Pairs strictly above the first threshold that gives enough, and the thresholds tried.

    Parameters
    ----------
    probability
        (n, m) of all pairs of source and target superpoints.
    """
    tried: list[Tried] = []
    enough = min(config.min_pairs, probability.numel())
    while not tried or tried[-1].pairs < enough:
        # by multiplication, so that rounding errors do not accumulate
        threshold = round(config.threshold - len(tried) * config.step, 9)
        tried.append(Tried(threshold, int((probability > threshold).sum())))
        if threshold < 0.0:
            break
    source, target = (probability > tried[-1].threshold).nonzero(as_tuple=True)
    confidence = probability[source, target]
    if config.max_pairs is not None and len(confidence) > config.max_pairs:
        best = confidence.topk(config.max_pairs).indices.sort().values
        source, target, confidence = source[best], target[best], confidence[best]
    return NodePairs(source, target, confidence), tried
