# SPDX-License-Identifier: MIT
"""Which pairs and which methods of a table a figure shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from hybridreg.eval.report.plotly_figures import badness
from hybridreg.eval.run.row import Row
from hybridreg.eval.score.protocols import Protocol
from hybridreg.eval.scored_table import Entry, Table

# A picture wider than this cannot be read.
_MOST_METHODS = 6
_LARGEST = 1e6


def methods_of(table: Table, names: Sequence[str] = ()) -> list[Entry]:
    """The lines of those names, or of which a name is the beginning; without names the first six.

    Raises
    ------
    ValueError
        A name that no line has; it lists those that there are.
    """
    entries = [entry for entry in table.methods if entry.rows]
    if not names:
        return entries[:_MOST_METHODS]
    chosen = []
    for name in names:
        fitting = [e for e in entries if e.name == name] or [e for e in entries if e.name.startswith(name)]
        if not fitting:
            raise ValueError(f"no line is called {name!r}; there are {'; '.join(e.name for e in entries)}")
        chosen += [entry for entry in fitting if entry not in chosen]
    return chosen


def pairs_of(
    entries: Sequence[Entry], protocol: Protocol, ids: Sequence[str] = (), worst: int = 0, first: int = 3
) -> list[str]:
    """Names of pairs: those asked for, or the `worst` by the mean over the methods of error over threshold, or the
    `first` of the data.

    Raises
    ------
    ValueError
        A pair that no method has a row of, or nothing to choose from.
    """
    rows = {entry.name: {row.id: row for row in entry.rows if row.T_true is not None} for entry in entries}
    known = list(dict.fromkeys(name for each in rows.values() for name in each))
    if not known:
        raise ValueError("there is no pair of known truth to show")
    unknown = [name for name in ids if name not in known]
    if unknown:
        raise ValueError(
            f"no row is of the pair {unknown[0]!r}; there are {', '.join(known[:8])} ({len(known)} in all)"
        )
    if ids:
        return list(ids)
    if not worst:
        return known[:first]
    errors = {
        name: _badness([each[name] for each in rows.values() if name in each], protocol) for name in known
    }
    return sorted(known, key=lambda name: -errors[name])[:worst]


def _badness(rows: Sequence[Row], protocol: Protocol) -> float:
    # A pair without a pose is worse than any pose, and two of them are worse than one.
    return float(np.minimum(badness(rows, protocol), _LARGEST).mean())


def row_of(entry: Entry, pair: str) -> Row | None:
    """A method's row of a pair."""
    return next((row for row in entry.rows if row.id == pair), None)


def wrapped(name: str, width: int = 26) -> str:
    """A method's name in lines that a column has room for."""
    import textwrap

    return "\n".join(textwrap.wrap(name, width)) or name
