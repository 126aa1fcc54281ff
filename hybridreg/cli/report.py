# SPDX-License-Identifier: MIT
"""`hybridreg report`: score stored predictions again, without running anything."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hybridreg.cli import options, outputs
from hybridreg.cli.terminal.error_messages import plainly

if TYPE_CHECKING:
    from hybridreg.eval.score.protocols import Protocol
    from hybridreg.eval.scored_table import Table
    from hybridreg.pair import LabelledPair


@plainly
def command(
    paths: Annotated[
        list[Path],
        typer.Argument(help="A table's folder; or several runs to compare, files or folders."),
    ],
    protocols: options.Protocols = None,
    data: Annotated[str | None, typer.Option(help="Where the data is now, for the 3D views.")] = None,
    out: Annotated[Path | None, typer.Option(help="Folder; the table's own if not given.")] = None,
    pictures: Annotated[
        int,
        typer.Option(min=0, help="Run the pipelines again on this many pairs and draw matches and masks."),
    ] = 0,
) -> None:
    """Write the reports of a table again, under any protocol."""
    from hybridreg.cli import table_running
    from hybridreg.eval import stored_table
    from hybridreg.eval.score.protocols import protocol

    folder = paths[0] if len(paths) == 1 and paths[0].is_dir() else None
    if folder is not None:
        done, names = stored_table.load(folder), list(stored_table.read_index(folder).protocols)
    else:
        files = [file for path in paths for file in stored_table.files_in(path)]
        done, names = stored_table.of_files(files), ["cross3dreg", "kitti"]
    chosen = [protocol(name) for name in protocols or names]
    written, pairs = out or folder or Path("runs/report"), _data(done, data)
    outputs.check_folder(written)
    table_running.write(done, chosen, written, pairs)
    if pictures:
        _draw(done, chosen[0], pairs, written / "pictures", pictures)


def _draw(done: Table, chosen: Protocol, pairs: Sequence[LabelledPair] | None, folder: Path, n: int) -> None:
    from hybridreg.eval.report.rerun_for_pictures import redraw

    if pairs is None:
        raise ValueError(f"--pictures {n} needs the data {done.data!r}, which is not here; name it by --data")
    print(f"{len(redraw(done, chosen, pairs, folder, n))} pictures in {folder}")


def _data(done: Table, data: str | None) -> Sequence[LabelledPair] | None:
    # The views are an extra: missing data must not prevent scoring. But data that is named must open.
    from hybridreg.cli.table_running import with_starts
    from hybridreg.data import open_dataset

    try:
        return with_starts(open_dataset(data or done.data), done.starts, done.seed)
    except (OSError, ValueError):
        if data is not None:
            raise
        return None
