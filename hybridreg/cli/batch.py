# SPDX-License-Identifier: MIT
"""`hybridreg batch`: many unlabelled pairs, or many scans against one map."""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path
from typing import Annotated

import typer

from hybridreg.cli import options, outputs
from hybridreg.cli.terminal.command_line_cures import spoken
from hybridreg.cli.terminal.error_messages import plainly
from hybridreg.cli.terminal.stop_signals import going_on
from hybridreg.config.number_of import number_of


@plainly
def command(
    what: Annotated[
        list[str],
        typer.Argument(
            help="A CSV list (source,target,id), or clouds: paths, or a pattern such as 'scans/*.pcd'."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for rows.jsonl and poses.csv.")],
    target: Annotated[Path | None, typer.Option(help="The target of all that name none; read once.")] = None,
    preset: options.Preset = None,
    pipeline: options.PipelineFile = None,
    settings: options.Settings = None,
    voxel: options.Voxel = None,
    seed: options.Seed = 0,
    drop: Annotated[bool, typer.Option("--drop", help="Leave points out that are not finite.")] = False,
    target_viewpoint: options.Viewpoint = "auto",
    workers: options.Workers = 1,
    overwrite: options.Overwrite = False,
) -> None:
    """Register many pairs; a batch that was cut off goes on, and one table holds all poses and verdicts."""
    from rich.console import Console
    from rich.progress import Progress

    from hybridreg.many.batch_run import WRITTEN, run
    from hybridreg.many.jobs import jobs_of

    jobs = jobs_of(what, target)
    outputs.check_folder(
        out, WRITTEN, [*what, *(cloud for job in jobs for cloud in (job.source, job.target))]
    )
    with (
        going_on(lambda: f"finished pairs are kept in {out}: the same command goes on from there"),
        Progress(console=Console(stderr=True), disable=not sys.stderr.isatty()) as progress,
    ):
        bar = progress.add_task("pairs", total=len(jobs))
        rows = run(
            jobs,
            out,
            options.changes_of(preset, pipeline, settings, voxel),
            seed=seed,
            workers=workers,
            overwrite=overwrite,
            nonfinite="drop" if drop else "raise",
            target_viewpoint=options.viewpoint(target_viewpoint, "--target-viewpoint"),
            on_row=lambda row: progress.advance(bar),
            spoken=spoken,
        )
    counts = Counter(row["verdict"] for row in rows)
    for row in rows:
        if row["error"]:
            print(f"{row['id']}: {spoken(row['error'])}")
    print(
        f"{number_of(len(rows), 'pair')}: "
        + ", ".join(f"{counts[word]} {word}" for word in ("ok", "doubtful", "failed"))
    )
    print(f"written to {out}: rows.jsonl, poses.csv")
