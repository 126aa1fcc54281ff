# SPDX-License-Identifier: MIT
"""Pairs listed by their files: what every loader of a published data set returns."""

from __future__ import annotations

import hashlib
import inspect
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from hybridreg.data import content
from hybridreg.data.dataset import Dataset
from hybridreg.data.lists import dataset_options
from hybridreg.data.lists.pair_files import PairFiles, PairTable
from hybridreg.data.lists.required_files import refuse_missing
from hybridreg.pair import LabelledPair

# Data sets whose direction this process has checked. Not kept in the set itself: a parallel run unpickles a set for
# every task, which would then read 20 pairs to return one.
_CHECKED: set[tuple[str, int]] = set()


class ListedPairs(Dataset):
    """A data set whose pairs are listed by their files; a pair is read on access.

    Parameters
    ----------
    entries : sequence of PairFiles
    origin : path
        What the list came from, for messages.
    if_inverted : str
        Where the poses' direction is not certain: what to do if they turn out to be inverted. The first access then
        compares the poses of up to 20 pairs with their inverses (`hybridreg.data.lists.direction`).
    overlap_radius : float
        Metres within which two points count as the same place: 0.5 outdoors.
    fields : tuple of str
        What the data set's own list calls its columns.

    Raises
    ------
    FileNotFoundError
        A listed file does not exist.
    ValueError
        No entries, or two of one id.
    """

    def __init__(
        self,
        entries: Sequence[PairFiles],
        origin: Path,
        *,
        if_inverted: str = "",
        overlap_radius: float = 0.5,
        fields: tuple[str, ...] = (),
    ) -> None:
        self.entries, self.origin, self.fields = PairTable(entries), origin, fields
        self.overlap_radius = overlap_radius
        self.if_inverted = if_inverted
        if not self.entries:
            raise ValueError(f"{origin}: it gives no pairs; are its clouds and poses of one drive?")
        _refuse_doubles(self.entries.ids, origin)
        refuse_missing((f for e in entries for f in e.files() if f is not None), str(origin))

    @classmethod
    def from_text(cls, text: str) -> ListedPairs:
        """Open a loader by "PATH" or "PATH#option,name=value"; options are its constructor's, in order."""
        loader: Callable[..., ListedPairs] = cls
        path, options = dataset_options.parse(text, inspect.signature(loader))
        return loader(path, **options)

    @property
    def ids(self) -> tuple[str, ...]:
        return self.entries.ids

    def read(self, index: int) -> LabelledPair:
        """Read pair `index` as it is listed, without checking the direction of its pose."""
        return self.entries[index].read()

    def load(self, index: int) -> LabelledPair:
        if self.if_inverted:
            self.vouch()
        return self.read(index)

    def vouch(self) -> None:
        """`check`, once a process."""
        if (key := (str(self.origin), self.entries.digest())) not in _CHECKED:
            self.check()
            _CHECKED.add(key)

    def check(self) -> None:
        """Refuse poses of the wrong direction: before the first pair is returned where the direction is not certain;
        elsewhere before tables, predictions and training, of a list that was changed, and only where it is clear."""
        from hybridreg.data.lists import direction

        if self.if_inverted:
            direction.check(self, str(self.origin), self.if_inverted)
        else:
            direction.check(self, str(self.origin), direction.CURE, n=direction.A_FEW, clearly=True)

    def fingerprint(self) -> str:
        total = hashlib.blake2b(f"{self.entries.digest():08x}".encode(), digest_size=8)
        for index in range(len(self)):
            total.update(" ".join(content.digest(file) for file in self.entries.paths(index)).encode())
        return total.hexdigest()

    def looks(self) -> str:
        return content.looks_of_all(f for index in range(len(self)) for f in self.entries.paths(index))

    def pair_fingerprint(self, index: int) -> str:
        """Of the content of the pair's own files and its pose."""
        entry = self.entries[index]
        total = hashlib.blake2b(np.round(entry.T_target_source, 9).tobytes(), digest_size=8)
        total.update(" ".join(content.digest(file) for file in self.entries.paths(index)).encode())
        return f"{total.hexdigest()}-{entry.id}"


def _refuse_doubles(ids: tuple[str, ...], origin: Path) -> None:
    double, times = Counter(ids).most_common(1)[0]
    if times > 1:
        raise ValueError(f"{origin}: lists the pair {double!r} {times} times; leave one of them")
