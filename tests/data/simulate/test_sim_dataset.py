# SPDX-License-Identifier: MIT
from __future__ import annotations

import pickle
from dataclasses import replace

import pytest

from hybridreg.data import YawStarts, open_dataset, simulate
from hybridreg.data.dataset import fingerprint_of
from hybridreg.data.loaders import simulated
from hybridreg.data.simulate import TIERS, Drawn, pair_number


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch, mid_pair: Drawn) -> list[tuple[str, int]]:
    """Pairs cost nothing; tells which were drawn."""
    numbers: list[tuple[str, int]] = []
    monkeypatch.setattr(
        "hybridreg.data.simulate.labelled.draw", lambda tier, n, *_: numbers.append((tier, n)) or mid_pair
    )
    simulated._drawn.cache_clear()
    return numbers


def test_names_are_known_before_anything_is_drawn(asked: list[tuple[str, int]]) -> None:
    pairs = open_dataset("sim:test/near")
    assert len(pairs) == 50
    assert simulated.Simulated("test/near").ids[17] == "sim:test/near/0/17"
    assert asked == []
    assert pairs[17].pair.id == "sim:test/near/0/17"
    assert asked == [("near", pair_number("test", 0, 17))]


def test_seed_and_number_of_pairs_can_be_asked_for(asked: list[tuple[str, int]]) -> None:
    assert len(open_dataset("sim:val/mid#7")) == 7
    assert len(open_dataset("sim:train/far/3")) == 50
    pairs = open_dataset("sim:train/far/3#200")
    assert len(pairs) == 200
    assert pairs[-1].pair.id == "sim:train/far/3/199"
    assert asked == [("far", pair_number("train", 3, 199))]


def test_a_pair_of_the_data_set_is_the_pair_of_its_name(
    asked: list[tuple[str, int]],
) -> None:
    one, other = open_dataset("sim:val/mid/2#3")[1], simulate.pair("mid", seed=2, index=1, split="val")
    assert one.pair.id == other.pair.id
    assert asked[0] == asked[1]


def test_it_travels_to_workers_without_its_pairs(asked: list[tuple[str, int]]) -> None:
    pairs = open_dataset("sim:val/mid#3")
    _ = pairs[0]
    sent = pickle.dumps(pairs)
    assert len(sent) < 1000
    back = pickle.loads(sent)
    assert fingerprint_of(back) == fingerprint_of(pairs)
    assert back[0].pair.id == pairs[0].pair.id


def test_yaw_starts_draw_each_pair_once(asked: list[tuple[str, int]]) -> None:
    starts = YawStarts(open_dataset("sim:val/mid#2"), 3)
    assert len({labelled.pair.id for labelled in starts}) == 8
    assert len(asked) == 2


def test_fingerprint_tells_version_seed_tier_split_and_number_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    texts = ("test/near", "test/mid", "val/near", "test/near/1", "test/near#51")
    prints = {fingerprint_of(open_dataset(f"sim:{text}")) for text in texts}
    assert len(prints) == len(texts)
    assert fingerprint_of(open_dataset("sim:test/near/0#50")) in prints
    later = replace(TIERS["near"], version=1_000)
    monkeypatch.setattr(simulated, "tier_named", lambda _: later)
    assert fingerprint_of(open_dataset("sim:test/near")) not in prints


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("near", "sim:near: write sim:SPLIT/TIER"),
        ("test/near#", "sim:test/near#: write"),
        ("test/nearby", "'nearby'.*near, mid, far"),
        ("exam/near", "'exam'.*train, val, test"),
        ("test/near#0", "0 pairs"),
        ("test/near/1000", "seed 1000"),
        ("test/near#1000001", "pair 1000000 is outside"),
    ],
)
def test_what_cannot_be_drawn_is_refused_at_once(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        open_dataset(f"sim:{text}")
