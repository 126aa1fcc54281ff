# SPDX-License-Identifier: MIT
"""Which pair comes when, and how it is disturbed, depends on the seed and the number alone."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from training_runs import MakeRecipe

from hybridreg.learned.training.data.order import Order
from hybridreg.learned.training.data.pair_source import open_source
from hybridreg.learned.training.data.samples import PhaseSamples, Sample, stream

SIZES = st.lists(st.integers(1, 9), min_size=1, max_size=4)


@given(SIZES, st.integers(0, 5), st.integers(1, 60))
def test_the_order_follows_from_seed_and_number(sizes: list[int], seed: int, samples: int) -> None:
    order = Order(sizes, [1.0] * len(sizes), samples, (seed, 0))
    drawn = [order[number] for number in range(samples)]
    again = Order(sizes, [1.0] * len(sizes), samples, (seed, 0))
    assert [again[number] for number in reversed(range(samples))] == drawn[::-1]
    assert all(0 <= pair < sizes[source] for source, pair in drawn)


@given(SIZES, st.integers(0, 5))
def test_every_pair_comes_once_before_any_comes_again(sizes: list[int], seed: int) -> None:
    order = Order(sizes, [1.0] * len(sizes), 40, (seed, 1))
    seen: dict[int, list[int]] = {}
    for source, pair in (order[number] for number in range(40)):
        seen.setdefault(source, []).append(pair)
    for source, drawn in seen.items():
        counts = Counter(drawn)
        times = [counts[pair] for pair in range(sizes[source])]
        assert max(times) - min(times) <= 1


def test_seed_and_phase_change_it() -> None:
    drawn = {
        tuple(Order([50], [1.0], 20, seed)[number] for number in range(20))
        for seed in ((0, 0), (1, 0), (0, 1))
    }
    assert len(drawn) == 3


def test_weights_are_shares() -> None:
    order = Order([5, 5, 5], [3.0, 1.0, 0.0], 4000, (0, 0))
    counts = Counter(order[number][0] for number in range(4000))
    assert counts[0] / counts[1] == pytest.approx(3.0, rel=0.15)
    assert counts[2] == 0
    with pytest.raises(ValueError, match="no training source has both pairs and a weight"):
        Order([0, 5], [1.0, 0.0], 3, (0, 0))


def test_samples_do_not_depend_on_who_asks_or_when(make_recipe: MakeRecipe, cache: Path) -> None:
    recipe = make_recipe()
    source = open_source(recipe.data.train[0], recipe, cache)

    def samples(seed: int = 3) -> PhaseSamples:
        return PhaseSamples([source], Order([2], [1.0], 6, (seed, 0)), recipe.augmentation, (seed, 0))

    def drawn(numbers: list[int], loaders: int = 0, seed: int = 3) -> dict[int, Sample]:
        found = stream(samples(seed), numbers, loaders)
        return {sample.number: sample for sample in found if isinstance(sample, Sample)}

    all_of_them, late = drawn([0, 1, 2, 3]), drawn([3, 1])
    assert set(late) == {1, 3}
    for number, sample in late.items():
        assert equal(sample, all_of_them[number])
    elsewhere = drawn([1], loaders=1)
    assert equal(elsewhere[1], late[1])
    assert not equal(drawn([1], seed=4)[1], late[1])


def equal(a: Sample, b: Sample) -> bool:
    assert a.batch.image is not None
    assert b.batch.image is not None
    return (
        a.id == b.id
        and all(
            torch.equal(p, q) for p, q in zip(a.batch.pyramid.points, b.batch.pyramid.points, strict=True)
        )
        and torch.equal(a.targets.transform, b.targets.transform)
        and torch.equal(a.batch.image, b.batch.image)
    )
