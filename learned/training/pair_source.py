# SPDX-License-Identifier: MIT
"""A data set as training reads it: prepared pairs, from the disk where they were prepared before."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from torch import Tensor

from hybridreg.data import content, open_dataset
from hybridreg.data.dataset import ids_of, pair_fingerprints_of
from hybridreg.learned.config import NetworkConfig
from hybridreg.learned.training.prepared import PreparedPair, cloud_key, prepare_clouds, restore, shrink_image
from hybridreg.learned.training.recipe import Recipe, Source
from hybridreg.learned.training.tensor_cache import NotKept, TensorCache
from hybridreg.pair import LabelledPair

# Beside the prepared pairs: hashes of the files they came from.
_DIGESTS = "contents.json"


@dataclass(frozen=True, eq=False, kw_only=True)
class PairSource:
    """The pairs of one source of a recipe.

    Attributes
    ----------
    usable : numbers of the pairs that could be prepared
    partner : how far a true partner may lie, voxels (`InfoNceConfig.partner`)
    """

    title: str
    pairs: Sequence[LabelledPair]
    ids: tuple[str, ...]
    fingerprints: tuple[str, ...]
    usable: tuple[int, ...]
    config: NetworkConfig
    partner: float
    cache: TensorCache

    def __len__(self) -> int:
        return len(self.usable)

    @property
    def content(self) -> str:
        """Changes when the pairs do; where nothing is kept, when their names do."""
        return f"{zlib.crc32(repr(self.fingerprints).encode()):08x}"

    def only(self, usable: tuple[int, ...]) -> PairSource:
        """The source with these pairs alone."""
        return replace(self, usable=tuple(usable))

    def load(self, number: int, scale: float = 1.0) -> PreparedPair:
        """Pair ``usable[number]``; a scale other than 1 is computed anew."""
        index = self.usable[number]
        lazy = _Lazy(self.pairs, index)
        cache = self.cache if scale == 1.0 else TensorCache(None)
        tensors = cache.get(
            self._cloud_key(index),
            lambda: prepare_clouds(lazy.pair(), self.config, self.partner, scale),
            must_keep=False,
        )
        return restore(
            self.ids[index], tensors, self._image(index, lazy, must_keep=False), self.config.backbone
        )

    def prepare(self, index: int) -> str | None:
        """Put pair ``index`` into the cache; why it cannot be used, or None.

        Raises
        ------
        NotKept
            The cache cannot be written.
        """
        try:
            lazy = _Lazy(self.pairs, index)
            self.cache.get(
                self._cloud_key(index), lambda: prepare_clouds(lazy.pair(), self.config, self.partner)
            )
            self._image(index, lazy)
        except NotKept:  # a full disk is no fault of the pair
            raise
        except Exception as error:  # one bad pair must not end the run: it is named and left out
            return " ".join(f"{type(error).__name__}: {error}".split())
        return None

    def is_prepared(self, index: int) -> bool:
        """Does the cache hold pair ``index``?"""
        image = self.config.image is None or self.cache.has(self._image_key(index))
        return image and self.cache.has(self._cloud_key(index))

    def _cloud_key(self, index: int) -> tuple[object, ...]:
        return ("clouds", self.fingerprints[index], cloud_key(self.config, self.partner))

    def _image_key(self, index: int) -> tuple[object, ...]:
        image = self.config.image
        return ("image", self.fingerprints[index], image and (image.height, image.width))

    def _image(self, index: int, lazy: _Lazy, *, must_keep: bool = True) -> Tensor | None:
        config = self.config.image
        if config is None:
            return None

        def make() -> dict[str, Tensor]:
            image = lazy.pair().pair.image
            return {} if image is None else {"image": shrink_image(image, config.height, config.width)}

        return self.cache.get(self._image_key(index), make, must_keep=must_keep).get("image")


class _Lazy:
    """A pair read when it is first needed: a cache that holds everything reads nothing."""

    def __init__(self, pairs: Sequence[LabelledPair], index: int) -> None:
        self._pairs, self._index = pairs, index
        self._read: LabelledPair | None = None

    def pair(self) -> LabelledPair:
        if self._read is None:
            self._read = self._pairs[self._index]
        return self._read


def open_source(source: Source, recipe: Recipe, cache: Path, *, told: bool = True) -> PairSource:
    """Open a source; its pairs are not prepared yet, and all of them count as usable.

    The content of their files is part of what they are kept under; ``told=False`` leaves it out, for a process that
    hears it from another, as does data of which nothing is kept.

    Raises
    ------
    ValueError, FileNotFoundError
        The data cannot be opened, or has no pairs.
    """
    pairs = open_dataset(source.data)
    n = min(len(pairs), source.pairs) if source.pairs else len(pairs)
    if n == 0:
        raise ValueError(f"{source.title}: a data set of 0 pairs; training needs one at least")
    keep = source.prepared and not recipe.augmentation.rescales
    with content.kept_in(cache / _DIGESTS if keep else None):
        fingerprints = tuple(pair_fingerprints_of(pairs, n)) if keep and told else ids_of(pairs)[:n]
    return PairSource(
        title=source.title,
        pairs=pairs,
        ids=ids_of(pairs)[:n],
        fingerprints=fingerprints,
        usable=tuple(np.arange(n).tolist()),
        config=recipe.network,
        partner=recipe.infonce.partner,
        cache=TensorCache(cache if keep else None),
    )
