# SPDX-License-Identifier: MIT
"""`sim:test/near`: simulated pairs as a data set, generated on access."""

from __future__ import annotations

import re
from functools import lru_cache

from hybridreg.data.dataset import Dataset
from hybridreg.data.simulate.difficulty import tier_named
from hybridreg.data.simulate.labelled import pair, pair_id
from hybridreg.data.simulate.splits import pair_number
from hybridreg.pair import LabelledPair

PAIRS = 50
_FORM = re.compile(r"(?P<split>\w+)/(?P<tier>\w+)(/(?P<seed>\d+))?(#(?P<pairs>\d+))?")


class Simulated(Dataset):
    """The first pairs of one split, tier and seed of the simulator.

    Parameters
    ----------
    text : "SPLIT/TIER", then perhaps "/SEED", then perhaps "#PAIRS"
        "test/near" is what tables are computed on: seed 0, 50 pairs. "train/far/3#200" has seed 3 and 200 pairs.

    Raises
    ------
    ValueError
        For a text of another form, an unknown split or tier, a seed outside the split, no or too many pairs.
    """

    def __init__(self, text: str) -> None:
        found = _FORM.fullmatch(text)
        if found is None:
            raise ValueError(f"sim:{text}: write sim:SPLIT/TIER, sim:SPLIT/TIER/SEED or either with #PAIRS")
        self.split, self.tier = found["split"], found["tier"]
        self.seed, self.pairs = int(found["seed"] or 0), int(found["pairs"] or PAIRS)
        if found["pairs"] and self.pairs == 0:
            raise ValueError(f"sim:{text}: a data set of 0 pairs; ask for one at least")
        self.version = tier_named(self.tier).version
        pair_number(self.split, self.seed, self.pairs - 1)

    @property
    def ids(self) -> tuple[str, ...]:
        return tuple(pair_id(self.split, self.tier, self.seed, index) for index in range(self.pairs))

    def load(self, index: int) -> LabelledPair:
        return _drawn(self.split, self.tier, self.seed, index)

    def fingerprint(self) -> str:
        """Changes with the version of the tier's pairs too, as the same names then stand for other pairs."""
        return f"sim{self.version}-{super().fingerprint()}"

    def pair_fingerprint(self, index: int) -> str:
        """The pair's name and the version of the tier's pairs, however many pairs are asked for."""
        return f"sim{self.version}-{pair_id(self.split, self.tier, self.seed, index)}"


# Yaw rotations read the same pair several times in a row.
@lru_cache(maxsize=1)
def _drawn(split: str, tier: str, seed: int, index: int) -> LabelledPair:
    return pair(tier, seed=seed, index=index, split=split)
