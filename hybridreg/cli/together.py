# SPDX-License-Identifier: MIT
"""`hybridreg together`: many clouds into one frame."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from hybridreg.cli import options, outputs
from hybridreg.cli.terminal.error_messages import VERDICT_FAILED, plainly
from hybridreg.cli.terminal.stop_signals import going_on


@plainly
def command(
    what: Annotated[
        list[str],
        typer.Argument(help="Clouds along a drive or tour: paths, or a pattern such as 'scans/*.pcd'."),
    ],
    out: Annotated[Path, typer.Option(help="Folder for links, poses and verdicts.")],
    unordered: Annotated[
        bool, typer.Option("--unordered", help="Neighbours in the list need not be near.")
    ] = False,
    reference: Annotated[
        str | None, typer.Option(help="The cloud whose frame all get, by its name; the first if not given.")
    ] = None,
    preset: options.Preset = None,
    pipeline: options.PipelineFile = None,
    settings: options.Settings = None,
    voxel: options.Voxel = None,
    seed: options.Seed = 0,
    drop: Annotated[bool, typer.Option("--drop", help="Leave points out that are not finite.")] = False,
    viewpoint: options.Viewpoint = "auto",
    merged: Annotated[Path | None, typer.Option(help="Write all placed clouds as one: ply or pcd.")] = None,
    form: options.Format = "matrix",
    workers: options.Workers = 1,
    overwrite: options.Overwrite = False,
) -> None:
    """Put many clouds into one frame, by links between them; a run that was cut off goes on."""
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    from hybridreg.many.together_run import WRITTEN, files_of, run

    options.check_form(form)
    files = files_of(what)
    outputs.check_folder(out, WRITTEN, files)
    outputs.check_clouds((merged,), files, out)
    columns = (
        SpinnerColumn(),
        TextColumn("{task.completed:.0f} pairs of {task.description}"),
        TimeElapsedColumn(),
    )
    with (
        going_on(lambda: f"registered pairs are kept in {out}: the same command goes on from there"),
        Progress(*columns, console=Console(stderr=True), disable=not sys.stderr.isatty()) as progress,
    ):
        bar = progress.add_task(f"{len(files)} clouds", total=None)
        found = run(
            files,
            out,
            options.changes_of(preset, pipeline, settings, voxel),
            ordered=not unordered,
            reference=reference,
            seed=seed,
            workers=workers,
            overwrite=overwrite,
            nonfinite="drop" if drop else "raise",
            viewpoint=options.viewpoint(viewpoint, "--viewpoint"),
            form=form,
            merged=merged,
            on_link=lambda: progress.advance(bar),
        )
    print(found.summary())
    print(f"written to {out}: poses.csv, links.csv, alignment.json, and the poses as {form}")
    if merged is not None:
        print(f"written: {merged}")
    if found.verdict == "failed":
        raise typer.Exit(VERDICT_FAILED)
