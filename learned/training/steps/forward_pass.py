# SPDX-License-Identifier: MIT
"""The losses of one process's share of an optimiser step."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence

import numpy as np
import torch

from hybridreg.learned.cross3dreg.encodings import Known
from hybridreg.learned.cross3dreg.network import RegistrationNetwork
from hybridreg.learned.cross3dreg.training_mask import MaskJitter
from hybridreg.learned.pretrained import Pretrained
from hybridreg.learned.pyramid.packed import packed
from hybridreg.learned.training.data.frozen import FrozenFeatures, lasting
from hybridreg.learned.training.data.samples import Sample
from hybridreg.learned.training.data.training_examples import Example, learn
from hybridreg.learned.training.recipe import Phase, Recipe
from hybridreg.learned.training.steps.objective import Outcome, objective


class ForwardPass:
    """Losses of the samples of a phase; `seed` and a sample's number fix its random choices."""

    def __init__(self, network: Pretrained, recipe: Recipe, phase: Phase, seed: Sequence[int]) -> None:
        self.network, self.recipe, self.phase, self._seed = network, recipe, phase, tuple(seed)
        self._frozen = None
        if isinstance(network, RegistrationNetwork):
            keep = lasting(phase, recipe.augmentation, recipe.network.backbone)
            self._frozen = FrozenFeatures(network, keep)

    def groups(self, places: Sequence[int]) -> list[list[int]]:
        """Places of a step's batch, grouped by what is processed at once."""
        if self.network.together:
            return [list(places)]
        size = self.phase.packed
        return [list(places[first : first + size]) for first in range(0, len(places), size)]

    def __call__(self, found: Sequence[Sample | Example], pairs: Sequence[Hashable]) -> Iterator[Outcome]:
        """Losses ready for ``backward``: of each sample, or one of all examples; `pairs` says which pairs they are."""
        examples = [each for each in found if isinstance(each, Example)]
        if examples:
            self._draw(examples[0].number)
            yield learn(self.network, examples)
            return
        samples = [each for each in found if isinstance(each, Sample)]
        for sample, known in zip(samples, self._known(samples, pairs), strict=True):
            yield self._of(sample, known)

    def _of(self, sample: Sample, known: Known | None) -> Outcome:
        assert isinstance(self.network, RegistrationNetwork)
        generator = self._draw(sample.number)
        jitter = MaskJitter(use_predicted=self.phase.use_predicted)
        return objective(
            self.network, sample, self.phase.losses, self.recipe.infonce, jitter, generator, known
        )

    def _draw(self, number: int) -> torch.Generator:
        seeds = np.random.SeedSequence([*self._seed, 3, number]).generate_state(2)
        torch.manual_seed(int(seeds[0]))  # for random choices of the network itself: dropped images
        return torch.Generator().manual_seed(int(seeds[1]))

    def _known(self, samples: Sequence[Sample], pairs: Sequence[Hashable]) -> list[Known | None]:
        assert self._frozen is not None
        known = [self._frozen.of(pair, one.batch) for pair, one in zip(pairs, samples, strict=True)]
        if len(samples) == 1 or known[0] is not None:
            return known
        return [*_encoded(self.network, samples)]


def _encoded(network: Pretrained, samples: Sequence[Sample]) -> Iterator[Known]:
    # The backbone's output for each of several pairs that went through it at once.
    assert isinstance(network, RegistrationNetwork)
    pyramid = packed([sample.batch.pyramid for sample in samples])
    coarse, fine = network.backbone(torch.cat([sample.batch.features for sample in samples]), pyramid)

    def of_each(rows: torch.Tensor, stage: int) -> tuple[torch.Tensor, ...]:
        return rows.split([sum(sample.batch.pyramid.lengths[stage]) for sample in samples])

    for one, other in zip(
        of_each(coarse, -1), of_each(fine, network.config.backbone.fine_stage - 1), strict=True
    ):
        yield Known(one, other)
