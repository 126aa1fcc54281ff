# SPDX-License-Identifier: MIT
"""Data sets: sequences of labelled pairs whose names are known before any of them is read."""

from __future__ import annotations

import os
import zlib
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import overload

from hybridreg.pair import LabelledPair


class Dataset(Sequence[LabelledPair], ABC):
    """A sequence of pairs that are read on access.

    Any sequence of `LabelledPair` can be evaluated; this class adds names without reading, which makes
    resuming quick, and a fingerprint, by which a changed data set is detected.
    """

    @property
    @abstractmethod
    def ids(self) -> tuple[str, ...]:
        """Names of the pairs, all different."""

    @abstractmethod
    def load(self, index: int) -> LabelledPair:
        """Read pair number `index`, 0 to len - 1."""

    def fingerprint(self) -> str:
        """Changes with the pairs or their true poses, by the content of their files."""
        return f"{zlib.crc32(repr(self.ids).encode()):08x}"

    def looks(self) -> str:
        """Unchanged only where no file was touched, which is quicker to find than a fingerprint; empty where that is
        unknown."""
        return ""

    def pair_fingerprint(self, index: int) -> str:
        """Changes with pair number `index`: a key under which results computed from the pair can be stored."""
        return f"{self.fingerprint()}-{self.ids[index]}"

    def __len__(self) -> int:
        return len(self.ids)

    @overload
    def __getitem__(self, index: int) -> LabelledPair: ...

    @overload
    def __getitem__(self, index: slice) -> list[LabelledPair]: ...

    def __getitem__(self, index: int | slice) -> LabelledPair | list[LabelledPair]:
        if isinstance(index, slice):
            return [self.load(i) for i in range(*index.indices(len(self)))]
        if isinstance(index, str):
            raise TypeError(f"pair {index!r}: pairs have numbers; its own is pairs.ids.index({index!r})")
        if not -len(self) <= index < len(self):
            raise IndexError(f"pair {index} of a data set of {len(self)}")
        return self.load(index % len(self))


def ids_of(pairs: Sequence[LabelledPair]) -> tuple[str, ...]:
    """Names of the pairs of any sequence; a sequence without `ids` is read through.

    Raises
    ------
    TypeError
        No sequence of `LabelledPair`.
    ValueError
        Two pairs with one name, which a resumed run could not tell apart.
    """
    if isinstance(pairs, (str, os.PathLike)):
        raise TypeError(f"pairs {os.fspath(pairs)!r}: hybridreg.data.open_dataset(...) opens a data set")
    if not (hasattr(pairs, "__len__") and hasattr(pairs, "__getitem__")):
        raise TypeError(f"pairs: expected a data set or a list of LabelledPair, got {type(pairs).__name__}")
    known = getattr(pairs, "ids", None)
    ids = tuple(known) if known is not None else tuple(map(_id_of, pairs))
    if len(set(ids)) < len(ids):
        double = next(i for i in ids if ids.count(i) > 1)
        raise ValueError(
            f"the data set has {ids.count(double)} pairs called {double!r}; give each its own id"
        )
    return ids


def _id_of(labelled: LabelledPair) -> str:
    if not isinstance(labelled, LabelledPair):
        raise TypeError(f"pairs: expected LabelledPair, got {type(labelled).__name__} among them")
    return labelled.pair.id


def vouch(pairs: Sequence[LabelledPair]) -> None:
    """Look at the poses' direction before any pair is handed out, where the sequence can.

    Raises
    ------
    WrongDirection
        They map target to source; a ValueError that says how to open the data set then.
    """
    from hybridreg.data.lists.direction import WrongDirection

    own = getattr(pairs, "vouch", None)
    if callable(own):
        try:
            own()
        except WrongDirection:
            raise
        except (OSError, ValueError):
            return  # a pair that cannot be read is told where it is read


def fingerprint_of(pairs: Sequence[LabelledPair]) -> str:
    """Fingerprint of any sequence: its own where it has one, otherwise that of the names."""
    own = getattr(pairs, "fingerprint", None)
    return str(own()) if callable(own) else f"{zlib.crc32(repr(ids_of(pairs)).encode()):08x}"


def looks_of(pairs: Sequence[LabelledPair]) -> str:
    """What is known of the files of any sequence without reading them: `Dataset.looks`; empty where it is not known."""
    own = getattr(pairs, "looks", None)
    return str(own()) if callable(own) else ""


def pair_fingerprints_of(pairs: Sequence[LabelledPair], n: int | None = None) -> list[str]:
    """Fingerprint of each pair (the first ``n``) of any sequence: its own where it has one, otherwise the sequence's
    and its name."""
    own = getattr(pairs, "pair_fingerprint", None)
    if callable(own):
        return [str(own(index)) for index in range(len(pairs) if n is None else n)]
    whole = fingerprint_of(pairs)
    return [f"{whole}-{name}" for name in ids_of(pairs)[:n]]
