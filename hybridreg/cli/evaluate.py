# SPDX-License-Identifier: MIT
"""`hybridreg eval`: one pipeline over a data set."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hybridreg.cli import options
from hybridreg.cli.terminal.error_messages import plainly


@plainly
def command(
    data: Annotated[str, typer.Option(help="Folder of pairs, or name:rest of a loader.")],
    preset: options.Preset = None,
    pipeline: options.PipelineFile = None,
    settings: options.Settings = None,
    voxel: options.Voxel = None,
    protocols: options.Protocols = None,
    starts: Annotated[
        int, typer.Option(min=0, help="Repeat each pair under this many random yaw rotations.")
    ] = 0,
    seed: options.Seed = 0,
    workers: options.Workers = 1,
    out: Annotated[Path | None, typer.Option(help="Folder; runs/<pipeline> if not given.")] = None,
    overwrite: options.Overwrite = False,
) -> None:
    """Predict the poses of a data set once, and score them; an interrupted run continues where it stopped."""
    from hybridreg.cli import table_running
    from hybridreg.eval import table_file
    from hybridreg.presets import DEFAULT

    changes = options.changes_of(preset, pipeline, settings, voxel)
    name = table_file.title_of(changes) if changes else DEFAULT
    content = {
        "title": f"Pipeline {name}",
        "seed": seed,
        "starts": starts,
        "row": [{"name": name, **changes}],
        **({"protocols": protocols} if protocols else {}),
    }
    folder = out or Path("runs") / table_file.slug(name)
    table_running.run(table_file.parse(content), data, folder, workers=workers, overwrite=overwrite)
