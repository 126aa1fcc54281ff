# SPDX-License-Identifier: MIT
"""Running a table file from the command line: progress, tables on the screen, reports in a folder."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from hybridreg.cli.terminal.console import shown
from hybridreg.cli.terminal.stop_signals import going_on

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridreg.eval.report.table_columns import Cells
    from hybridreg.eval.score.protocols import Protocol
    from hybridreg.eval.scored_table import Table
    from hybridreg.eval.table_file import Recipe
    from hybridreg.pair import LabelledPair


def run(recipe: Recipe, data: str, out: Path, *, workers: int, overwrite: bool) -> None:
    """Run a table file with a progress bar on stderr, print its tables and write its reports."""
    from rich.console import Console
    from rich.progress import Progress

    from hybridreg.data import open_dataset
    from hybridreg.eval import table_run

    pairs = open_dataset(data)
    n = len(pairs) * (recipe.starts + 1)
    anew = ", without --overwrite," if overwrite else ""
    kept = f"finished rows are kept in {out}: the same command{anew} continues from there"
    with (
        going_on(lambda: kept),
        Progress(console=Console(stderr=True), disable=not sys.stderr.isatty()) as progress,
    ):
        bars = {line.name: progress.add_task(line.name, total=n) for line in recipe.lines if line.method}
        done = table_run.run(
            recipe,
            pairs,
            out,
            data=data,
            workers=workers,
            overwrite=overwrite,
            on_row=lambda name, _: progress.advance(bars[name]),
        )
    write(done, recipe.protocols, out, with_starts(pairs, recipe.starts, recipe.seed))
    if failure := done.failure():
        raise ValueError(failure)


def with_starts(pairs: Sequence[LabelledPair], starts: int, seed: int) -> Sequence[LabelledPair]:
    """The pairs under the random yaw rotations that a table was run with."""
    from hybridreg.data import YawStarts

    return YawStarts(pairs, starts, seed) if starts else pairs


def write(
    done: Table, protocols: Sequence[Protocol], out: Path, pairs: Sequence[LabelledPair] | None
) -> None:
    """Write the reports and print the tables; where one fails, the other is still made."""
    from hybridreg.eval.report import formats, table_report

    problem: OSError | None = None
    try:
        files = table_report.write(done, protocols, out, pairs)
        told = f"written to {out}: {', '.join(file.name for file in files)}"
    except OSError as error:
        problem = error
    for protocol in protocols:
        print_table(done.caption(protocol), formats.tables(done, protocol)["Results"])
    if done.paper is not None:
        print_table(done.paper.heading(), done.paper.cells())
    for remark in done.remarks():
        print(remark)
    if problem is not None:
        raise problem
    print(told)


def print_table(caption: str, lines: Sequence[Cells]) -> None:
    """Print a table as wide as its content, whatever the terminal."""
    from rich.console import Console
    from rich.table import Table as Grid
    from rich.text import Text

    # As text: a name in brackets is not a style.
    grid = Grid(title=Text(shown(caption)), title_justify="left")
    for key in lines[0]:
        grid.add_column(Text(shown(key)), justify="left" if key == "method" else "right", no_wrap=True)
    for line in lines:
        grid.add_row(*(Text(shown(cell)) for cell in line.values()))
    wide = Console(width=10_000)
    fitting = max(240, wide.measure(grid).maximum)
    console = Console(width=None if sys.stdout.isatty() else fitting)
    console.print(grid)
