# SPDX-License-Identifier: MIT
"""The same pairs under random yaw rotations: sensors on one vehicle keep one pose, which a method may have learnt."""

from __future__ import annotations

import dataclasses
import re
import zlib
from collections.abc import Iterable, Sequence

import numpy as np

from hybridreg.cloud import PointCloud
from hybridreg.data.dataset import Dataset, fingerprint_of, ids_of, looks_of, vouch
from hybridreg.geometry import se3
from hybridreg.pair import LabelledPair


class YawStarts(Dataset):
    """Every pair as it is, and `n` times with its source rotated about the sensor's z by a random angle.

    Pairs are called `name` and `name@yaw1` to `name@yaw<n>`. The angle depends on the seed, the name and the number
    alone, so it is the same whatever other pairs there are.
    """

    def __init__(self, pairs: Sequence[LabelledPair], n: int = 3, seed: int = 0) -> None:
        if n < 0:
            raise ValueError(f"starts={n} must not be negative")
        self.pairs, self.n, self.seed = pairs, n, seed
        self._names = ids_of(pairs)

    @property
    def ids(self) -> tuple[str, ...]:
        return tuple(name if k == 0 else f"{name}@yaw{k}" for name in self._names for k in range(self.n + 1))

    def load(self, index: int) -> LabelledPair:
        which, k = divmod(index, self.n + 1)
        labelled = self.pairs[which]
        if k == 0:
            return labelled
        rng = np.random.default_rng([self.seed, zlib.crc32(self._names[which].encode()), k])
        return turned(labelled, float(rng.uniform(-180.0, 180.0)), self.ids[index])

    def fingerprint(self) -> str:
        return f"{fingerprint_of(self.pairs)}-yaw{self.n}-{self.seed}"

    def looks(self) -> str:
        return looks_of(self.pairs)

    def vouch(self) -> None:
        """As the pairs themselves do."""
        vouch(self.pairs)


def start_of(name: str) -> str:
    """Name of the pair that a start of this name was made from; of any other pair its own."""
    return re.sub(r"@yaw\d+$", "", name)


def starts_in(names: Iterable[str]) -> int:
    """How many starts each pair was given, by the names of all of them."""
    return max((int(found[1]) for name in names if (found := re.search(r"@yaw(\d+)$", name))), default=0)


def yaw_starts(pairs: Sequence[LabelledPair], n: int = 3, seed: int = 0) -> YawStarts:
    """Each pair, and `n` more with the source under a seeded random yaw rotation and the true pose adapted."""
    return YawStarts(pairs, n, seed)


def turned(labelled: LabelledPair, yaw_deg: float, id: str) -> LabelledPair:
    """The pair with its source rotated about the z axis through its sensor, and its true pose adapted."""
    pair = labelled.pair
    turn = se3.yaw(yaw_deg)
    points = se3.apply(turn, pair.source.points)
    points.setflags(write=False)
    source: PointCloud = dataclasses.replace(pair.source, points=points)
    # In the user's coordinates the axis goes through the offset, not through the map's origin.
    offset = pair.source.offset
    turn[:3, 3] = offset - turn[:3, :3] @ offset
    return dataclasses.replace(
        labelled,
        pair=pair.replaced(source=source, id=id),
        T_target_source=labelled.T_target_source @ se3.inverse(turn),
    )
