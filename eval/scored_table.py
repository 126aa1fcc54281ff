# SPDX-License-Identifier: MIT
"""Methods side by side on the same pairs, with all that a report tells of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from hybridreg.config.number_of import number_of
from hybridreg.eval.run.row import Row
from hybridreg.eval.score import doubted_truths, scoring
from hybridreg.eval.score.paper import Printed
from hybridreg.eval.score.protocols import Protocol

IDENTITY = "identity"
# In the note of a stage whose network looks at the clouds on a grid of its own (`learned.stages.network_grid`).
OWN_GRID = "put the clouds on a grid of its own"


@dataclass(frozen=True, eq=False, kw_only=True)
class Entry:
    """One method's rows; `config` is what made them."""

    name: str
    rows: list[Row]
    config: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class Table:
    """Methods side by side.

    Attributes
    ----------
    entries : the identity first, then the methods
    starts : turned copies of each pair
    problems : lines that could not be built or run, with the reason
    left_out : what some lines did without, for want of a package
    visits : training pairs that a method's weights have seen, repeats counted; methods without weights
        are left out
    paper : figures that somebody printed, to be shown apart
    """

    title: str
    data: str
    seed: int
    starts: int
    entries: list[Entry]
    problems: dict[str, str] = field(default_factory=dict)
    left_out: dict[str, str] = field(default_factory=dict)
    visits: dict[str, int] = field(default_factory=dict)
    paper: Printed | None = None

    def remarks(self) -> list[str]:
        """Sentences on what was not run or not read."""
        without = (f"{name} ran without {text}" for name, text in self.left_out.items())
        return [
            *(f"Not run: {name}. {problem}" for name, problem in self.problems.items()),
            *without,
            *self._unread(),
            *self._own_grids(),
            *doubted_truths.remarks([row for entry in self.methods for row in entry.rows]),
        ]

    def _unread(self) -> list[str]:
        rows = max((entry.rows for entry in self.entries), key=len, default=[])
        unread = [row for row in rows if row.T_true is None]
        if not unread:
            return []
        first = f"; the first, {unread[0].id}: {unread[0].error}" if unread[0].error else ""
        return [
            f"{len(unread)} of {number_of(len(rows), 'pair')} could not be read: against the recall, in no other "
            f"number{first}"
        ]

    def failure(self) -> str:
        """Why every row of every method failed, by the first; empty where one did not."""
        rows = [(entry.name, row) for entry in self.methods for row in entry.rows]
        if not rows or any(row.error is None for _, row in rows):
            return ""
        name, first = rows[0]
        return f"all {len(rows)} rows failed; the first, {first.id} by {name}: {first.error}"

    def _own_grids(self) -> list[str]:
        # What a downsampling stage chose does not reach a network that has a grid of its own.
        names = [
            e.name for e in self.methods if any(OWN_GRID in note for row in e.rows for note in row.notes)
        ]
        whose = "all methods" if 1 < len(names) == len(self.methods) else "; ".join(names)
        told = "What the downsample slot chose did not reach the networks of"
        return [f"{told} {whose}: each {OWN_GRID}"] if names else []

    @property
    def methods(self) -> list[Entry]:
        """The entries but the identity."""
        return [entry for entry in self.entries if entry.name != IDENTITY]

    def scores(self, protocol: Protocol) -> dict[str, scoring.Score]:
        """Score of every entry that has rows."""
        return {entry.name: scoring.score(entry.rows, protocol) for entry in self.entries if entry.rows}

    def caption(self, protocol: Protocol) -> str:
        """Which number is this: the data, the starts, the protocol."""
        n = max((len(entry.rows) for entry in self.entries), default=0)
        runs = number_of(n, "pair")
        if self.starts:
            pairs = n // (self.starts + 1)
            turned = number_of(self.starts, "random yaw rotation")
            runs = f"{number_of(pairs, 'pair')}, each as it is and under {turned}, {n} runs"
        return f"{self.title}. Data {self.data or 'unnamed'}, {runs}; {protocol.describe()}"
