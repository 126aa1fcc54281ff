# SPDX-License-Identifier: MIT
"""The command line application and its commands."""

from __future__ import annotations

from typing import Annotated

import typer

import hybridreg
from hybridreg.cli import (
    batch,
    datasets,
    demo,
    doctor,
    evaluate,
    figure,
    listing,
    register,
    report,
    simulate,
    table,
    together,
    train,
    view,
)
from hybridreg.runtime.garbage import collect_as_usual

# Commands that do one thing and end.
_SHORT = frozenset({"register", "view", "list", "doctor", "demo"})

app = typer.Typer(
    name="hybridreg",
    help="Register point clouds from different sensors, and evaluate registration pipelines.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        print(f"hybridreg {hybridreg.__version__}")
        raise typer.Exit


@app.callback()
def _common(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    if context.invoked_subcommand not in _SHORT:
        collect_as_usual()


app.command("register")(register.command)
app.command("batch")(batch.command)
app.command("view")(view.command)
app.command("together")(together.command)
app.command("eval")(evaluate.command)
app.command("table")(table.command)
app.command("report")(report.command)
app.command("figure")(figure.command)
app.command("train")(train.command)
app.command("simulate")(simulate.command)
app.command("list")(listing.command)
app.command("doctor")(doctor.command)
app.command("demo")(demo.command)
app.add_typer(datasets.app, name="datasets")
