# SPDX-License-Identifier: MIT
"""`hybridreg train`: a network from a recipe."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import Annotated

import typer

from hybridreg.cli import options
from hybridreg.cli.terminal.error_messages import plainly
from hybridreg.cli.terminal.stop_signals import Stopped, going_on


@plainly
def command(
    recipe: Annotated[str, typer.Argument(help="TOML file, or the name of one: `hybridreg list recipes`.")],
    data: Annotated[
        list[str] | None,
        typer.Option(
            help="Training data instead of the recipe's; NAME=DATA replaces one source, or gives a folder that the "
            "recipe leaves open. Repeatable."
        ),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder; runs/<recipe's name> if not given.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Continue from the folder's checkpoint.")] = False,
    devices: Annotated[int, typer.Option(min=1, help="Processes, one a GPU; torchrun sets its own.")] = 1,
    accelerator: Annotated[str, typer.Option(help="auto, cpu, cuda or mps.")] = "auto",
    steps_scale: Annotated[float, typer.Option(help="Factor on the length of all phases.")] = 1.0,
    cache: Annotated[Path, typer.Option(help="Folder of prepared pairs, shared by runs.")] = Path(
        "runs/prepared"
    ),
    workers: options.Workers = 1,
) -> None:
    """Train a network; if stopped or killed, continue with --resume. Writes the weights and their model card."""
    from hybridreg.learned.training import recipe_file
    from hybridreg.learned.training.data import data_choice
    from hybridreg.learned.training.loop import CHECKPOINT
    from hybridreg.learned.training.stop_flag import StopFlag
    from hybridreg.learned.training.training_run import RunOptions, train
    from hybridreg.runtime.heap import keep_freed_memory

    keep_freed_memory()
    wanted = recipe_file.read(recipe)
    if data:
        wanted = data_choice.with_data(wanted, data)
    if steps_scale != 1.0:
        wanted = recipe_file.scaled(wanted, steps_scale)
    folder = out or Path("runs") / wanted.name
    run = RunOptions(
        out=folder, cache=cache, resume=resume, devices=devices, accelerator=accelerator, workers=workers
    )
    flag = StopFlag()

    def how() -> str:
        if (folder / CHECKPOINT).is_file():
            return f"continue with --resume --out {folder}"
        return f"prepared pairs are kept in {cache}: the same command continues from there"

    with going_on(how):
        best = train(wanted, run, flag)
        if best is None:  # other processes of the run hear of it from the first
            raise Stopped(flag.number or signal.SIGTERM)
    print(f"written to {best}: weights and card")
