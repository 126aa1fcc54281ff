# SPDX-License-Identifier: MIT
"""`hybridreg figure`: the paper's figures from a table that was run."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hybridreg.cli.terminal.error_messages import plainly

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridreg.eval.score.protocols import Protocol
    from hybridreg.eval.scored_table import Entry, Table
    from hybridreg.pair import LabelledPair


class Kind(str, Enum):
    """What to draw."""

    registrations = "registrations"
    matches = "matches"
    curves = "curves"
    masks = "masks"


# Pairs that are shown where none is asked for.
_FIRST = {Kind.registrations: 3, Kind.matches: 2, Kind.masks: 1}


@plainly
def command(
    kind: Annotated[Kind, typer.Argument(help="registrations, matches, curves or masks.")],
    run: Annotated[Path, typer.Argument(help="Folder of a table that `hybridreg table` or `eval` ran.")],
    methods: Annotated[
        list[str] | None,
        typer.Option("--method", help="A line, or how its name begins; repeatable; else the first six."),
    ] = None,
    pairs: Annotated[
        list[str] | None, typer.Option("--pair", help="A pair by its name; repeatable; else the first few.")
    ] = None,
    worst: Annotated[
        int, typer.Option(min=0, help="This many pairs of the largest errors, in place of named ones.")
    ] = 0,
    data: Annotated[str | None, typer.Option(help="Where the data lies now.")] = None,
    protocol: Annotated[
        str | None, typer.Option(help="Rule of scoring; the table's first if not given.")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder; RUN/figures if not given.")] = None,
) -> None:
    """Draw a figure as PNG and PDF; curves as CSV too. Matches and masks run their pipelines once more."""
    from hybridreg.eval import table_run
    from hybridreg.eval.report import curve_panels, figure_choice
    from hybridreg.eval.score import protocols

    done, index = table_run.load(run), table_run.read_index(run)
    rule = protocols.protocol(protocol or index.protocols[0])
    everything = kind is Kind.curves and not methods
    entries = (
        [e for e in done.methods if e.rows] if everything else figure_choice.methods_of(done, methods or ())
    )
    folder = out or run / "figures"
    folder.mkdir(parents=True, exist_ok=True)
    if kind is Kind.curves:
        files = curve_panels.write(folder, entries, rule)
    else:
        names = figure_choice.pairs_of(entries, rule, pairs or (), worst, first=_FIRST[kind])
        files = _of_pairs(kind, folder, entries, _data(done, data), names, rule, done.seed)
    print(f"written to {folder}: {', '.join(file.name for file in files)}")


def _of_pairs(
    kind: Kind,
    folder: Path,
    entries: Sequence[Entry],
    data: Sequence[LabelledPair],
    names: Sequence[str],
    rule: Protocol,
    seed: int,
) -> list[Path]:
    from hybridreg.data.dataset import ids_of
    from hybridreg.eval.report import registration_grid, rerun_grid

    lost = [name for name in names if name not in ids_of(data)]
    if lost:
        raise ValueError(f"the data has no pair {lost[0]!r}; name by --data what the table was run on")
    if kind is Kind.registrations:
        return registration_grid.write(folder, entries, data, names, rule)
    if kind is Kind.matches:
        return rerun_grid.write_matches(folder, entries, data, names, rule, seed)
    return rerun_grid.write_masks(folder, entries, data, names, seed)


def _data(done: Table, data: str | None) -> Sequence[LabelledPair]:
    from hybridreg.cli.table_running import with_starts
    from hybridreg.data import open_dataset

    if not (data or done.data):
        raise ValueError("the table does not tell its data; name it by --data")
    return with_starts(open_dataset(data or done.data), done.starts, done.seed)
