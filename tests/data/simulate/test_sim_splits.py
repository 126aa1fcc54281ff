# SPDX-License-Identifier: MIT
from __future__ import annotations

from itertools import combinations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hybridreg.data.simulate.splits import PER_SEED, SPLITS, pair_number

SEEDS = {name: len(numbers) // PER_SEED for name, numbers in SPLITS.items()}


def test_no_two_splits_share_a_number() -> None:
    for a, b in combinations(SPLITS.values(), 2):
        assert a.stop <= b.start or b.stop <= a.start


@given(st.data())
def test_every_pair_has_its_own_number_inside_its_split(data: st.DataObject) -> None:
    def draw() -> tuple[str, int, int]:
        split = data.draw(st.sampled_from(list(SPLITS)))
        return split, data.draw(st.integers(0, SEEDS[split] - 1)), data.draw(st.integers(0, PER_SEED - 1))

    one, other = draw(), draw()
    assert pair_number(*one) in SPLITS[one[0]]
    assert (pair_number(*one) == pair_number(*other)) == (one == other)


@pytest.mark.parametrize(
    ("split", "seed", "index", "said"),
    [
        ("tets", 0, 0, "'tets'.*train, val, test"),
        ("test", -1, 0, "seed -1"),
        ("test", SEEDS["test"], 0, f"0 to {SEEDS['test'] - 1}"),
        ("val", 0, PER_SEED, str(PER_SEED)),
    ],
)
def test_numbers_outside_say_what_is_wrong(split: str, seed: int, index: int, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        pair_number(split, seed, index)
