# SPDX-License-Identifier: MIT
"""The command line application and its commands."""

from __future__ import annotations

import typer

from hybridreg.cli import datasets, demo, doctor, evaluate, listing, register, report, simulate, table, train

app = typer.Typer(
    name="hybridreg",
    help="Register point clouds from different sensors, and evaluate registration pipelines.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command("register")(register.command)
app.command("eval")(evaluate.command)
app.command("table")(table.command)
app.command("report")(report.command)
app.command("train")(train.command)
app.command("simulate")(simulate.command)
app.command("list")(listing.command)
app.command("doctor")(doctor.command)
app.command("demo")(demo.command)
app.add_typer(datasets.app, name="datasets")
