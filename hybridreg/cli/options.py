# SPDX-License-Identifier: MIT
"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

Preset = Annotated[str | None, typer.Option(help="Pipeline by name; see `hybridreg list presets`.")]
PipelineFile = Annotated[Path | None, typer.Option(help="Pipeline as a TOML file, instead of a preset.")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="slot=name", help="Another stage, or slot.field=value; repeatable."),
]
Voxel = Annotated[float | None, typer.Option(help="Voxel, metres; derived from the clouds if not given.")]
Seed = Annotated[int, typer.Option(help="Fixes every random choice.")]
Protocols = Annotated[
    list[str] | None, typer.Option("--protocol", help="Evaluation protocol by name; repeatable.")
]
Workers = Annotated[int, typer.Option(min=1, help="Processes, each with one thread.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Run again what the folder already holds.")]

Viewpoint = Annotated[
    str,
    typer.Option(metavar="x,y,z|none|auto", help="Position of its sensor, metres in the cloud's own frame."),
]


def viewpoint(text: str, option: str) -> Any:
    """The viewpoint for `PointCloud.of` from `x,y,z`, `none` or `auto`."""
    if text in ("auto", "none"):
        return text
    try:
        place = tuple(float(part) for part in text.split(","))
    except ValueError:
        place = ()
    if len(place) != 3:
        raise ValueError(
            f"{option} {text}: give three numbers in metres, such as {option} 0,0,1.8, or none, or auto"
        )
    return place


def changes_of(
    preset: str | None, pipeline: Path | None, settings: list[str] | None, voxel: float | None
) -> dict[str, Any]:
    """The options that choose a pipeline, as `hybridreg.changes.build` takes them."""
    from hybridreg.changes import merge, parse

    given = {"preset": preset, "pipeline": pipeline, "voxel": voxel}
    return merge({key: value for key, value in given.items() if value is not None}, parse(settings or []))
