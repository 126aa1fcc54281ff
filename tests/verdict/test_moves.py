# SPDX-License-Identifier: MIT
"""The table of what each move of the search brings."""

from __future__ import annotations

from typing import Any

import pytest

from hybridreg import Pipeline
from hybridreg.verdict.training import moves
from hybridreg.verdict.training.moves import table


def row(pair: str, without: str, right: bool, verdict: str, seconds: float) -> dict[str, Any]:
    return {"pair": pair, "without": without, "right": right, "verdict": verdict, "seconds": seconds}


@pytest.mark.parametrize("without", moves.PATCHES)
def test_each_move_names_something_that_can_be_switched_off(without: str) -> None:
    owner, name, replacement = moves.PATCHES[without]
    assert type(getattr(owner, name)) is type(replacement)


@pytest.mark.parametrize("entry", moves.ENTRIES.values())
def test_each_entry_can_bewithout_entry(entry: str) -> None:
    whole = Pipeline.preset("default")
    assert len(moves.without_entry(whole, entry).estimate.of) == len(whole.estimate.of) - 1


def test_a_move_is_held_against_the_same_pairs_with_it() -> None:
    rows = [
        row("a", "none", True, "ok", 2.0),
        row("b", "none", True, "doubtful", 2.0),
        row("c", "none", False, "failed", 9.0),
        row("a", "GICP", True, "ok", 1.0),
        row("b", "GICP", False, "ok", 1.0),
    ]
    (line,) = [each for each in table(rows).splitlines() if each.startswith("| GICP")]
    assert line == "| GICP | 2 | 1 (2) | 1 (1) | 1 (0) | 0.50 |"
