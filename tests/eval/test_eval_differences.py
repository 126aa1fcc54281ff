# SPDX-License-Identifier: MIT
from __future__ import annotations

import numpy as np
import pytest
from eval_stubs import row

from hybridreg.eval import PROTOCOLS
from hybridreg.eval.report import formats
from hybridreg.eval.score.differences import cells, difference
from hybridreg.eval.scored_table import Entry, Table

KITTI = PROTOCOLS["kitti"]


def test_pairs_are_compared_with_themselves() -> None:
    # Hard and easy pairs differ far more than the methods: only pair by pair is the gain certain.
    rng = np.random.default_rng(0)
    theirs = rng.uniform(0.0, 0.8, 60)
    ours = theirs + 0.1 + rng.normal(0.0, 0.01, 60)
    found = difference(ours, theirs, [str(i) for i in range(60)])
    assert found.mean == pytest.approx((ours - theirs).mean())
    assert 0.09 < found.low < found.mean < found.high < 0.11


def test_a_difference_of_nothing_has_zero_in_its_interval() -> None:
    rng = np.random.default_rng(1)
    ours, theirs = (rng.integers(0, 2, 40).astype(float) for _ in range(2))
    found = difference(ours, theirs, [str(i) for i in range(40)])
    assert found.low < 0.0 < found.high
    same = difference(ours, ours, [str(i) for i in range(40)])
    assert same == (0.0, 0.0, 0.0)


def test_turned_copies_count_as_one_scene() -> None:
    ours, theirs = np.tile([1.0, 0.0, 1.0, 1.0], 4), np.tile([0.0, 0.0, 1.0, 0.0], 4)
    alone = difference(ours, theirs, [str(i) for i in range(16)])
    copies = difference(ours, theirs, [str(i % 4) for i in range(16)])
    assert copies.high - copies.low > alone.high - alone.low


def test_only_pairs_that_both_have_count() -> None:
    ours = [row(i, 1.0, 0.1, inlier_ratio={"1": 0.5}) for i in range(4)]
    theirs = [row(i, 50.0 if i < 2 else 1.0, 0.1, inlier_ratio={"1": 0.25}) for i in range(3)]
    line = cells("ours", ours, theirs, KITTI)
    assert line["recall %"] == "66.7"
    without = cells("ours", ours, [row(i, 1.0, 0.1) for i in range(4)], KITTI)
    assert without["inliers %"] == "–", "a method without matches has no inlier ratio"


def test_the_table_names_the_line_that_it_compares_with() -> None:
    entries = [
        Entry(name=name, rows=[row(i, rre, 0.1) for i in range(3)])
        for name, rre in (("identity", 90.0), ("(a)", 50.0), ("(b)", 1.0))
    ]
    found = formats.tables(Table(title="t", data="d", seed=0, starts=0, entries=entries), KITTI)
    (line,) = found["Difference to (a), pair by pair"]
    assert (line["method"], line["recall %"], line["recall, 95 % interval"]) == (
        "(b)",
        "100.0",
        "100.0 to 100.0",
    )
