# SPDX-License-Identifier: MIT
"""Running a recipe from the command line: progress, the tables on the screen, the reports in a folder."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridreg.eval.columns import Cells
    from hybridreg.eval.protocols import Protocol
    from hybridreg.eval.recipe import Recipe
    from hybridreg.eval.table import Table
    from hybridreg.pair import LabelledPair


def run(recipe: Recipe, data: str, out: Path, *, workers: int, overwrite: bool) -> None:
    """Run a recipe with a progress bar on stderr, print its tables and write its reports."""
    from rich.console import Console
    from rich.progress import Progress

    from hybridreg.data import open_dataset
    from hybridreg.eval import table

    pairs = open_dataset(data)
    n = len(pairs) * (recipe.starts + 1)
    with Progress(console=Console(stderr=True), disable=not sys.stderr.isatty()) as progress:
        bars = {line.name: progress.add_task(line.name, total=n) for line in recipe.lines if line.method}
        done = table.run(
            recipe,
            pairs,
            out,
            data=data,
            workers=workers,
            overwrite=overwrite,
            on_row=lambda name, _: progress.advance(bars[name]),
        )
    write(done, recipe.protocols, out, with_starts(pairs, recipe.starts, recipe.seed))


def with_starts(pairs: Sequence[LabelledPair], starts: int, seed: int) -> Sequence[LabelledPair]:
    """The pairs under the yaw starts that a table was run with."""
    from hybridreg.data import YawStarts

    return YawStarts(pairs, starts, seed) if starts else pairs


def write(
    done: Table, protocols: Sequence[Protocol], out: Path, pairs: Sequence[LabelledPair] | None
) -> None:
    """Print the tables and write the reports."""
    from hybridreg.eval import formats, report

    for protocol in protocols:
        print_table(done.caption(protocol), formats.tables(done, protocol)["Results"])
    if done.paper is not None:
        print_table(done.paper.heading(), done.paper.cells())
    for remark in done.remarks():
        print(remark)
    files = report.write(done, protocols, out, pairs)
    print(f"written to {out}: {', '.join(file.name for file in files)}")


def print_table(caption: str, lines: Sequence[Cells]) -> None:
    """Print a table as wide as its content, whatever the terminal."""
    from rich.console import Console
    from rich.table import Table as Grid

    grid = Grid(title=caption, title_justify="left")
    for key in lines[0]:
        grid.add_column(key, justify="left" if key == "method" else "right", no_wrap=True)
    for line in lines:
        grid.add_row(*line.values())
    console = Console(width=None if sys.stdout.isatty() else 240)
    console.print(grid)
