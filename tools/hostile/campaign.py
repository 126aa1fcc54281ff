# SPDX-License-Identifier: MIT
"""How many inputs of which kind are generated, and their outcomes."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from tools.hostile import hostile_clouds, hostile_files, hostile_tables, hostile_weights, images, stored
from tools.hostile.case import Case
from tools.hostile.watched import Outcome, Watched

_LOT = 10

# Number of each kind in a hundred inputs.
SHARES: dict[str, tuple[int, Callable[[], st.SearchStrategy[Any]]]] = {
    "arrays": (27, lambda: hostile_clouds.cases(default=False)),
    "arrays, preset default": (8, lambda: hostile_clouds.cases(default=True)),
    "files": (24, hostile_files.cases),
    "paths": (1, hostile_files.paths),
    "images": (10, images.cases),
    "toml": (15, hostile_tables.cases),
    "json": (12, stored.cases),
    "weights": (3, hostile_weights.cases),
}


@dataclass
class Report:
    """The result of a campaign.

    Attributes
    ----------
    counts : outcomes by kind and word
    findings : kind, case, what is wrong
    slowest : seconds, kind, case of the inputs that took longest, the longest first
    """

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    findings: list[tuple[str, Case, str]] = field(default_factory=list)
    slowest: list[tuple[float, str, Case]] = field(default_factory=list)
    messages: dict[str, str] = field(default_factory=dict)

    def add(self, name: str, case: Case, outcome: Outcome) -> None:
        """Count one outcome."""
        self.counts[name, outcome.word] += 1
        if outcome.word == "finding":
            self.findings.append((name, case, outcome.text))
        elif outcome.word == "refused":
            self.messages.setdefault(_sort_of(outcome.text), outcome.text)
        self.slowest.append((outcome.seconds, name, case))
        self.slowest = sorted(self.slowest, key=lambda each: -each[0])[:5]


def _sort_of(message: str) -> str:
    # Without folders, numbers and quoted text.
    return re.sub(r"/\S*/|'[^']*'|\"[^\"]*\"|[\d.]+", "", message)[:60]


def run(
    n: int,
    *,
    start: int = 0,
    kinds: tuple[str, ...] = (),
    limit: float = 30.0,
    on_case: Callable[[str, Case, Outcome], None] | None = None,
) -> Report:
    """Try at least `n` inputs, the same ones for the same `start`.

    Parameters
    ----------
    kinds : names in `SHARES`; all if empty
    limit : seconds beyond which an input counts as hanging
    """
    report = Report()
    with Watched(limit) as watched:
        for name, (share, strategy) in SHARES.items():
            if not kinds or name in kinds:
                wanted = n if kinds else -(-n * share // 100)
                for case in draw(strategy(), wanted, start):
                    outcome = watched.run(case)
                    report.add(name, case, outcome)
                    if on_case is not None:
                        on_case(name, case, outcome)
    return report


def draw(strategy: st.SearchStrategy[Case], n: int, start: int) -> list[Case]:
    """`n` different cases of a strategy."""
    drawn: dict[str, Case] = {}

    # In small batches, because hypothesis continues from what it drew before, and less and less is new.
    for lot in range(n):
        if len(drawn) >= n:
            break
        _draw_lot(strategy, drawn, start * 1_000_003 + lot)
    return list(drawn.values())[:n]


def _draw_lot(strategy: st.SearchStrategy[Case], drawn: dict[str, Case], start: int) -> None:
    @seed(start)
    @settings(
        max_examples=_LOT,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def keep(case: Case) -> None:
        drawn.setdefault(repr(case), case)

    keep()
