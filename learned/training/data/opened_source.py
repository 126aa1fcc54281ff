# SPDX-License-Identifier: MIT
"""A data set opened for a training run."""

from __future__ import annotations

import zlib
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridreg.data import content, open_dataset
from hybridreg.data.dataset import ids_of, pair_fingerprints_of, vouch
from hybridreg.learned.training.data.tensor_cache import NotKept, TensorCache
from hybridreg.pair import LabelledPair

if TYPE_CHECKING:
    from typing_extensions import Self

    from hybridreg.learned.training.data.augmentation import Augmentation
    from hybridreg.learned.training.recipe import Source

# Beside the prepared pairs: hashes of the files they came from.
_DIGESTS = "contents.json"


@dataclass(frozen=True, eq=False, kw_only=True)
class OpenedSource:
    """The pairs of one source of a recipe.

    Attributes
    ----------
    usable : numbers of the pairs that could be prepared
    """

    title: str
    pairs: Sequence[LabelledPair]
    ids: tuple[str, ...]
    fingerprints: tuple[str, ...]
    usable: tuple[int, ...]
    cache: TensorCache

    def __len__(self) -> int:
        return len(self.usable)

    @property
    def content(self) -> str:
        """Changes with the pairs; where nothing is stored, with their names."""
        return f"{zlib.crc32(repr(self.fingerprints).encode()):08x}"

    def only(self, usable: tuple[int, ...]) -> Self:
        """The source with only these pairs."""
        return replace(self, usable=tuple(usable))

    def prepare(self, index: int) -> str | None:
        """Put pair ``index`` into the cache; returns why it cannot be used, or None.

        Raises
        ------
        NotKept
            The cache cannot be written.
        """
        try:
            self.fill(index)
        except NotKept:  # a full disk is not the pair's fault
            raise
        except Exception as error:  # one bad pair must not end the run: it is named and left out
            return " ".join(f"{type(error).__name__}: {error}".split())
        return None

    @abstractmethod
    def fill(self, index: int) -> None:
        """Put pair ``index`` into the cache, or raise what is wrong with it."""

    @abstractmethod
    def is_prepared(self, index: int) -> bool:
        """Whether the cache holds pair ``index``."""

    @abstractmethod
    def sample(self, pair: int, number: int, how: Augmentation, rng: np.random.Generator) -> Any:
        """Sample ``number`` of a phase: the pair ``usable[pair]``, augmented."""


class LazyPair:
    """A pair that is read when first needed: with a complete cache nothing is read."""

    def __init__(self, pairs: Sequence[LabelledPair], index: int) -> None:
        self._pairs, self._index = pairs, index
        self._read: LabelledPair | None = None

    def pair(self) -> LabelledPair:
        """Read it once."""
        if self._read is None:
            self._read = self._pairs[self._index]
        return self._read


def opened(source: Source, cache: Path, *, rescales: bool, told: bool = True) -> dict[str, Any]:
    """The fields of an `OpenedSource`, all of whose pairs count as usable.

    Parameters
    ----------
    rescales
        Whether an augmentation would invalidate the stored tensors; nothing is then stored.
    told
        Whether the content of the files is part of the cache keys. Not for a process that receives it from another.

    Raises
    ------
    ValueError, FileNotFoundError
        The data cannot be opened, or has no pairs.
    """
    pairs = open_dataset(source.data)
    vouch(pairs)
    n = min(len(pairs), source.pairs) if source.pairs else len(pairs)
    if n == 0:
        raise ValueError(f"{source.title}: a data set of 0 pairs; training needs one at least")
    keep = source.prepared and not rescales
    with content.kept_in(cache / _DIGESTS if keep else None):
        fingerprints = tuple(pair_fingerprints_of(pairs, n)) if keep and told else ids_of(pairs)[:n]
    return {
        "title": source.title,
        "pairs": pairs,
        "ids": ids_of(pairs)[:n],
        "fingerprints": fingerprints,
        "usable": tuple(np.arange(n).tolist()),
        "cache": TensorCache(cache if keep else None),
    }
