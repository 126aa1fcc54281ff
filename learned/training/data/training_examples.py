# SPDX-License-Identifier: MIT
"""Samples of networks with their own examples: clouds are augmented first, then batch and targets are made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor

from hybridreg.frames import lower_pose
from hybridreg.learned.network_table import network_class
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.training.data.augmentation import Augmentation, draw_motions
from hybridreg.learned.training.data.opened_source import LazyPair, OpenedSource, opened
from hybridreg.learned.training.data.tensor_cache import Tensors
from hybridreg.learned.training.recipe import Recipe, Source
from hybridreg.learned.training.steps.objective import Outcome
from hybridreg.learned.true_pair import TruePair
from hybridreg.pair import LabelledPair

# Incremented when the stored tensors change their meaning.
VERSION = 1


@dataclass(frozen=True, kw_only=True)
class Example:
    """The data of a training step."""

    number: int
    id: str
    batch: Any
    targets: Any

    def to(self, device: torch.device | str) -> Example:
        """The same example on another device."""
        return replace(self, batch=self.batch.to(device), targets=self.targets.to(device))


@dataclass(frozen=True, eq=False, kw_only=True)
class ExampleSource(OpenedSource):
    """Pairs stored as clouds and true poses; the input of the network ``kind`` is computed each time."""

    kind: str
    config: Any

    def true_pair(self, number: int) -> TruePair:
        """Pair ``usable[number]`` without augmentation."""
        index = self.usable[number]
        lazy = LazyPair(self.pairs, index)
        return _restored(self.cache.get(self._key(index), lambda: _tensors(lazy.pair()), must_keep=False))

    def sample(self, pair: int, number: int, how: Augmentation, rng: np.random.Generator) -> Example:
        """As `OpenedSource.sample`."""
        scale = how.draw_scale(rng)
        motions = draw_motions(how, rng)
        moved = self.true_pair(pair).scaled(scale).moved(motions, how.jitter, rng)
        batch, targets = network_class(self.kind).example(moved, self.config, rng)
        return Example(number=number, id=self.ids[self.usable[pair]], batch=batch, targets=targets)

    def fill(self, index: int) -> None:
        """As `OpenedSource.fill`: a pair must be valid input of the network."""
        lazy = LazyPair(self.pairs, index)
        pair = _restored(self.cache.get(self._key(index), lambda: _tensors(lazy.pair())))
        network_class(self.kind).example(pair, self.config, np.random.default_rng(0))

    def is_prepared(self, index: int) -> bool:
        """As `OpenedSource.is_prepared`: clouds are stored for all networks, so that this one still has to check
        them."""
        return False

    def _key(self, index: int) -> tuple[object, ...]:
        return ("true pair", VERSION, self.fingerprints[index])


def open_examples(source: Source, recipe: Recipe, cache: Path, *, told: bool = True) -> ExampleSource:
    """Open a source; errors as `opened`."""
    fields = opened(source, cache, rescales=False, told=told)
    return ExampleSource(**fields, kind=recipe.kind, config=recipe.network)


def learn(network: Pretrained, examples: Sequence[Example]) -> Outcome:
    """Losses of one example, or of several in one step, ready for ``backward``."""
    pairs = [(example.batch, example.targets) for example in examples]
    batch, targets = network.collate(pairs) if network.together else pairs[0]
    losses = network.losses(network.training_output(batch), targets)
    return Outcome(total=losses.total, parts=dict(losses.parts), hits=losses.hits)


def _tensors(labelled: LabelledPair) -> Tensors:
    pair = labelled.pair
    found: dict[str, Tensor] = {"transform": torch.from_numpy(lower_pose(labelled.T_target_source, pair))}
    for name, cloud in (("target", pair.target), ("source", pair.source)):
        found[name] = torch.from_numpy(np.array(cloud.points, dtype=np.float32))
        if cloud.viewpoint is not None:
            found[f"{name}_viewpoint"] = torch.from_numpy(np.array(cloud.viewpoint, dtype=np.float64))
    return found


def _restored(tensors: Tensors) -> TruePair:
    def place(name: str) -> Any:
        return tensors[name].numpy() if name in tensors else None

    return TruePair.of(
        tensors["target"].double().numpy(),
        tensors["source"].double().numpy(),
        tensors["transform"].numpy(),
        (place("target_viewpoint"), place("source_viewpoint")),
    )
