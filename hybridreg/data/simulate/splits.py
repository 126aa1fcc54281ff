# SPDX-License-Identifier: MIT
"""Which pair numbers belong to which split: disjoint ranges."""

from __future__ import annotations

PER_SEED = 1_000_000
SPLITS = {
    "train": range(0, 4_000 * PER_SEED),
    "val": range(4_000 * PER_SEED, 5_000 * PER_SEED),
    "test": range(5_000 * PER_SEED, 6_000 * PER_SEED),
}


def pair_number(split: str, seed: int, index: int) -> int:
    """The number that alone determines pair `index` of `seed` in `split`.

    Raises
    ------
    ValueError
        For an unknown split, a seed outside it, or an index outside the seed's million.
    """
    if split not in SPLITS:
        raise ValueError(f"there is no split {split!r}; the splits are {', '.join(SPLITS)}")
    numbers = SPLITS[split]
    seeds = len(numbers) // PER_SEED
    if not 0 <= seed < seeds:
        raise ValueError(f"seed {seed} is outside split {split!r}, which has seeds 0 to {seeds - 1}")
    if not 0 <= index < PER_SEED:
        raise ValueError(f"pair {index} is outside 0 to {PER_SEED - 1}, the pairs of one seed")
    return numbers[seed * PER_SEED + index]
