# SPDX-License-Identifier: MIT
"""The pair of each sample, determined by the seed, the phase and the sample's number alone."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


class Order:
    """Sources drawn by weight; within a source, every pair once before any is repeated.

    Parameters
    ----------
    sizes
        Pairs of each source.
    weights
        Share of each source, in any unit; a weight of 0 leaves a source out.
    samples
        How many samples the phase has.
    seed
        What fixes the order: the run's seed and the phase.
    """

    def __init__(
        self, sizes: Sequence[int], weights: Sequence[float], samples: int, seed: Sequence[int]
    ) -> None:
        share = np.array([w if n else 0.0 for n, w in zip(sizes, weights, strict=True)])
        if not share.sum() > 0:
            raise ValueError("no training source has both pairs and a weight above 0")
        self._sizes, self._seed = tuple(sizes), tuple(seed)
        rng = np.random.default_rng([*seed, 0])
        self._source = rng.choice(len(sizes), size=samples, p=share / share.sum()).astype(np.int32)
        # How often each sample's source occurred before it.
        self._turn = np.zeros(samples, dtype=np.int64)
        for source in range(len(sizes)):
            mine = self._source == source
            self._turn[mine] = np.arange(mine.sum())

    def __len__(self) -> int:
        return len(self._source)

    def __getitem__(self, number: int) -> tuple[int, int]:
        """Source, and the pair's number in it."""
        source = int(self._source[number])
        turn, place = divmod(int(self._turn[number]), self._sizes[source])
        return source, int(_shuffled((*self._seed, 1, source, turn), self._sizes[source])[place])


@lru_cache(maxsize=16)
def _shuffled(seed: tuple[int, ...], n: int) -> NDArray[np.int64]:
    return np.random.default_rng(seed).permutation(n)
