# SPDX-License-Identifier: MIT
"""Training data of the default network: prepared pairs, read from disk where they were prepared before."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from torch import Tensor

from hybridreg.learned.cross3dreg.config import NetworkConfig
from hybridreg.learned.training.data.augmentation import Augmentation
from hybridreg.learned.training.data.opened_source import LazyPair, OpenedSource, opened
from hybridreg.learned.training.data.prepared import (
    PreparedPair,
    cloud_key,
    prepare_clouds,
    restore,
    shrink_image,
)
from hybridreg.learned.training.data.samples import Sample, augment
from hybridreg.learned.training.data.tensor_cache import TensorCache
from hybridreg.learned.training.recipe import Recipe, Source


@dataclass(frozen=True, eq=False, kw_only=True)
class PairSource(OpenedSource):
    """Pairs stored with everything that is invariant to rotation.

    Attributes
    ----------
    partner : largest distance of a true correspondence, voxels (`InfoNceConfig.partner`)
    """

    config: NetworkConfig
    partner: float

    def load(self, number: int, scale: float = 1.0) -> PreparedPair:
        """Pair ``usable[number]``; a scale other than 1 is computed each time."""
        index = self.usable[number]
        lazy = LazyPair(self.pairs, index)
        cache = self.cache if scale == 1.0 else TensorCache(None)
        tensors = cache.get(
            self._cloud_key(index),
            lambda: prepare_clouds(lazy.pair(), self.config, self.partner, scale),
            must_keep=False,
        )
        return restore(
            self.ids[index], tensors, self._image(index, lazy, must_keep=False), self.config.backbone
        )

    def sample(self, pair: int, number: int, how: Augmentation, rng: np.random.Generator) -> Sample:
        """As `OpenedSource.sample`."""
        prepared = self.load(pair, how.draw_scale(rng))
        return augment(prepared, number, how, self.config.image, rng)

    def fill(self, index: int) -> None:
        """As `OpenedSource.fill`."""
        lazy = LazyPair(self.pairs, index)
        self.cache.get(self._cloud_key(index), lambda: prepare_clouds(lazy.pair(), self.config, self.partner))
        self._image(index, lazy)

    def is_prepared(self, index: int) -> bool:
        """As `OpenedSource.is_prepared`."""
        image = self.config.image is None or self.cache.has(self._image_key(index))
        return image and self.cache.has(self._cloud_key(index))

    def _cloud_key(self, index: int) -> tuple[object, ...]:
        return ("clouds", self.fingerprints[index], cloud_key(self.config, self.partner))

    def _image_key(self, index: int) -> tuple[object, ...]:
        image = self.config.image
        return ("image", self.fingerprints[index], image and (image.height, image.width))

    def _image(self, index: int, lazy: LazyPair, *, must_keep: bool = True) -> Tensor | None:
        config = self.config.image
        if config is None:
            return None

        def make() -> dict[str, Tensor]:
            image = lazy.pair().pair.image
            return {} if image is None else {"image": shrink_image(image, config.height, config.width)}

        return self.cache.get(self._image_key(index), make, must_keep=must_keep).get("image")


def open_source(source: Source, recipe: Recipe, cache: Path, *, told: bool = True) -> PairSource:
    """Open a source; its pairs are not prepared yet, and all of them count as usable.

    The content of their files is part of the cache keys; ``told=False`` leaves it out, for a process that receives it
    from another; so does data of which nothing is stored.

    Raises
    ------
    ValueError, FileNotFoundError
        The data cannot be opened, or has no pairs.
    """
    fields = opened(source, cache, rescales=recipe.augmentation.rescales, told=told)
    return PairSource(**fields, config=recipe.network, partner=recipe.infonce.partner)
