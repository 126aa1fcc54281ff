# SPDX-License-Identifier: MIT
"""`hybridreg table`: several pipelines side by side, listed in a TOML file."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Annotated

import typer

from hybridreg.cli import options
from hybridreg.cli.terminal.error_messages import plainly


@plainly
def command(
    file: Annotated[str, typer.Argument(help="TOML file, or the name of one: `hybridreg list tables`.")],
    data: Annotated[
        str | None, typer.Option(help="Folder of pairs, or name:rest; overrides the file.")
    ] = None,
    protocols: options.Protocols = None,
    starts: Annotated[
        int | None, typer.Option(min=0, help="Random yaw rotations of each pair; overrides the file.")
    ] = None,
    workers: options.Workers = 1,
    out: Annotated[Path | None, typer.Option(help="Folder; runs/<file's name> if not given.")] = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Run a table, print it, and write it as Markdown, LaTeX, CSV and one HTML page."""
    from hybridreg.cli import table_running
    from hybridreg.eval import table_file
    from hybridreg.eval.score.protocols import protocol

    read = table_file.read(file)
    if protocols:
        read = dataclasses.replace(read, protocols=tuple(protocol(name) for name in protocols))
    if starts is not None:
        read = dataclasses.replace(read, starts=starts)
    where = data or read.data
    if not where:
        raise ValueError(f"{file} names no data; give --data, a folder of pairs or name:rest of a loader")
    folder = out or Path("runs") / Path(file).stem
    table_running.run(read, where, folder, workers=workers, overwrite=overwrite)
