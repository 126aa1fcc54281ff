# SPDX-License-Identifier: MIT
"""`hybridreg simulate`: a folder of simulated pairs."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from hybridreg.cli import options
from hybridreg.cli.terminal.error_messages import plainly
from hybridreg.cli.terminal.stop_signals import going_on


@plainly
def command(
    out: Annotated[Path, typer.Option(help="Folder; each pair becomes a folder in it.")],
    tier: Annotated[str, typer.Option(help="near, mid, far, degenerate or disjoint.")] = "mid",
    pairs: Annotated[int, typer.Option(min=1, help="How many.")] = 20,
    seed: Annotated[int, typer.Option(help="Seed: which sequence of pairs of the split.")] = 1,
    split: Annotated[str, typer.Option(help="train, val or test; no two share a scene.")] = "train",
    workers: options.Workers = 1,
    voxel: Annotated[
        float | None, typer.Option(help="Thin to one point per voxel of this edge, metres.")
    ] = None,
) -> None:
    """Draw pairs of two different LiDARs with a camera image each; an interrupted run continues."""
    from rich.console import Console
    from rich.progress import Progress

    from hybridreg.data.simulate.simulated_folder import write_pairs

    written = write_pairs(out, tier=tier, pairs=pairs, seed=seed, split=split, voxel=voxel, workers=workers)
    with (
        going_on(lambda: f"finished pairs are kept in {out}: the same command continues from there"),
        Progress(console=Console(stderr=True), disable=not sys.stderr.isatty()) as progress,
    ):
        folders = list(progress.track(written, total=pairs, description=f"{split}/{tier}"))
    size = sum(file.stat().st_size for folder in folders for file in folder.iterdir())
    print(f"written to {out}: {pairs} pairs, {size / 1e6 / pairs:.2f} MB each")
