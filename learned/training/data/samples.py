# SPDX-License-Identifier: MIT
"""Samples of a phase: augmented pairs by number, optionally read ahead by worker processes."""

from __future__ import annotations

import os
import pickle
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import DataLoader, Dataset

from hybridreg.learned.cross3dreg.batch import Batch
from hybridreg.learned.cross3dreg.config import ImageConfig
from hybridreg.learned.cross3dreg.image_input import image_tensor
from hybridreg.learned.cross3dreg.targets import Targets
from hybridreg.learned.training.data.augmentation import (
    Augmentation,
    draw_motions,
    move_pyramid,
    move_truth,
    relight,
)
from hybridreg.learned.training.data.opened_source import OpenedSource
from hybridreg.learned.training.data.order import Order
from hybridreg.learned.training.data.prepared import PreparedPair
from hybridreg.runtime.workers import end_with

if TYPE_CHECKING:
    from hybridreg.learned.training.data.training_examples import Example


@dataclass(frozen=True, kw_only=True)
class Sample:
    """The data of a training step."""

    number: int
    id: str
    batch: Batch
    targets: Targets
    partners: tuple[Tensor, Tensor]

    def to(self, device: torch.device | str) -> Sample:
        """The same sample on another device."""
        fields = {name: value.to(device) for name, value in vars(self.targets).items()}
        return replace(
            self,
            batch=self.batch.to(device),
            targets=Targets(**fields),
            partners=(self.partners[0].to(device), self.partners[1].to(device)),
        )


@dataclass(frozen=True, kw_only=True)
class Unusable:
    """A pair that could not be made into a sample."""

    number: int
    id: str
    problem: str


class PhaseSamples(Dataset[Any]):
    """All samples of a phase by number; each has its own random generator, so that order does not matter."""

    def __init__(
        self, sources: Sequence[OpenedSource], order: Order, augmentation: Augmentation, seed: Sequence[int]
    ) -> None:
        self.sources, self.order = tuple(sources), order
        self.augmentation, self.seed = augmentation, tuple(seed)

    def __len__(self) -> int:
        return len(self.order)

    def __getitem__(self, number: int) -> Sample | Example | Unusable:
        source, pair = self.order[number]
        rng = np.random.default_rng([*self.seed, 2, number])
        try:
            made: Sample | Example = self.sources[source].sample(pair, number, self.augmentation, rng)
        except Exception as error:  # a bad pair is a skipped step, named in the log
            name = self.id_of(number)
            return Unusable(
                number=number, id=name, problem=" ".join(f"{type(error).__name__}: {error}".split())
            )
        return made

    def id_of(self, number: int) -> str:
        """Name of a sample's pair."""
        source, pair = self.order[number]
        return self.sources[source].ids[self.sources[source].usable[pair]]


def augment(
    pair: PreparedPair, number: int, how: Augmentation, image: ImageConfig | None, rng: np.random.Generator
) -> Sample:
    """An augmented copy of a pair."""
    motions = draw_motions(how, rng)
    pyramid = move_pyramid(pair.pyramid, motions, how.jitter, rng)
    tensor = None
    if image is not None and pair.image is not None:
        tensor = image_tensor(relight(pair.image, how.light, rng), image.height, image.width)
    return Sample(
        number=number,
        id=pair.id,
        batch=Batch(pyramid=pyramid, features=pair.features, image=tensor),
        targets=replace(pair.targets, transform=move_truth(pair.targets.transform, motions)),
        partners=pair.partners,
    )


def undisturbed(pair: PreparedPair, image: ImageConfig | None) -> Sample:
    """A pair without augmentation, for validation."""
    still = Augmentation(rotation="none", shift=0.0, jitter=0.0, light=0.0)
    return augment(pair, 0, still, image, np.random.default_rng(0))


def stream(
    samples: PhaseSamples, numbers: Iterable[int], loaders: int
) -> Iterator[Sample | Example | Unusable]:
    """The samples of those numbers, in order; read ahead by ``loaders`` processes.

    They are sent through pipes, as bytes: torch uses /dev/shm, and where that is small, as in a container, it waits
    forever.

    Warns
    -----
    UserWarning
        The system cannot start processes (a full /dev/shm holds no semaphore): this one reads them itself.
    """
    wanted = list(numbers)
    if loaders:
        try:
            return map(pickle.loads, iter(_loader(samples, wanted, loaders)))
        except OSError as error:
            told = f"no loaders can be started here ({error}); samples are read between the steps"
            warnings.warn(told, UserWarning, stacklevel=2)
    return iter(_loader(samples, wanted, 0))


def _loader(samples: PhaseSamples, numbers: list[int], loaders: int) -> DataLoader[Any]:
    return DataLoader(
        samples,
        batch_size=None,
        sampler=numbers,
        num_workers=loaders,
        collate_fn=pickle.dumps if loaders else _as_it_is,
        prefetch_factor=4 if loaders else None,
        worker_init_fn=partial(_begin, os.getpid()),
    )


def _as_it_is(sample: Any) -> Any:
    return sample


def _begin(leader: int, _: int) -> None:
    # A forked process that asks GNU's OpenMP for threads waits forever for those of its parent: so not even the
    # libraries that read the variable (`hybridreg.runtime.resources.n_threads`) may ask for two.
    os.environ["OMP_NUM_THREADS"] = "1"
    torch.set_num_threads(1)
    end_with(leader)
