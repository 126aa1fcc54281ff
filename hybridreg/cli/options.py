# SPDX-License-Identifier: MIT
"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from hybridreg.io.recorded.recording import Selection

Preset = Annotated[str | None, typer.Option(help="Pipeline by name; see `hybridreg list presets`.")]
PipelineFile = Annotated[Path | None, typer.Option(help="Pipeline as a TOML file, instead of a preset.")]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="slot=name",
        help="Another stage (refine=icp) or a field (refine.kind=plane, prior.max_rotation=30); repeatable.",
    ),
]
Voxel = Annotated[float | None, typer.Option(help="Voxel, metres; derived from the clouds if not given.")]
Seed = Annotated[int, typer.Option(help="Fixes every random choice.")]
Protocols = Annotated[
    list[str] | None,
    typer.Option(
        "--protocol",
        help="By name; repeatable. If none: the table's, or cross3dreg and kitti.",
    ),
]
Workers = Annotated[int, typer.Option(min=1, help="Processes, each with one thread.")]
Overwrite = Annotated[bool, typer.Option("--overwrite", help="Run again what the folder already holds.")]

Topic = Annotated[str | None, typer.Option(help="Of a bag; `source's,target's` where they differ.")]
Index = Annotated[
    str | None,
    typer.Option(metavar="N[,N]", help="Message of a bag, scan of an E57 file; for both, or one each."),
]
At = Annotated[
    str | None, typer.Option(metavar="S[,S]", help="Seconds after a bag's start, instead of --index.")
]
Accumulate = Annotated[
    str | None, typer.Option(metavar="N[,N]", help="Lay so many messages of a bag on one another.")
]

Format = Annotated[
    str,
    typer.Option(
        "--format",
        help="Form of poses, printed and in --out: matrix, quaternion, ros-tf, urdf, cloudcompare, kitti, tum.",
    ),
]
Viewpoint = Annotated[
    str,
    typer.Option(metavar="x,y,z|none|auto", help="Position of its sensor, metres in the cloud's own frame."),
]

Init = Annotated[Path | None, typer.Option(help="A rough pose: a file of any --format, .npy or result.json.")]
MaxTranslation = Annotated[float | None, typer.Option(help="Farthest from there, metres.")]
MaxRotation = Annotated[float | None, typer.Option(help="Farthest turned from there, degrees.")]
Gravity = Annotated[
    str,
    typer.Option(
        metavar="known|unknown|up|x,y,z",
        help="'unknown': one cloud may be upside down; 'up': z points up in both; or the axis that does.",
    ),
]
Crop = Annotated[
    str | None,
    typer.Option(
        metavar="R|x,y,z,x,y,z",
        help="Of the target, what lies R metres from the start, or in a box (low, high).",
    ),
]
CropSource = Annotated[
    str | None, typer.Option(metavar="x,y,z,x,y,z", help="Of the source, what lies in a box.")
]
Scale = Annotated[bool, typer.Option("--scale", help="The source's size is not known: estimate it.")]


_BOX = "the six numbers of a box (lowest x, y, z, then highest)"


def prior(
    init: Path | None,
    max_translation: float | None,
    max_rotation: float | None,
    gravity: str,
    crop: str | None,
    crop_source: str | None,
    scale: bool,
) -> dict[str, Any]:
    """What of `hybridreg.prior.prior.Prior` the command line tells."""
    region: dict[str, Any] = {}
    if crop is not None:
        numbers = _region(crop, "--crop", (1, 6), f"a radius in metres, or {_BOX}")
        region["radius" if len(numbers) == 1 else "target"] = numbers[0] if len(numbers) == 1 else numbers
    if crop_source is not None:
        region["source"] = _region(crop_source, "--crop-source", (6,), _BOX)
    vertical: Any = gravity
    if gravity not in ("known", "unknown", "up"):
        words = "known, unknown, up, or three numbers along the vertical such as 0,1,0"
        vertical = _numbers(gravity, "--gravity", (3,), words)
    told = {
        "init": init,
        "max_translation": max_translation,
        "max_rotation": max_rotation,
        "gravity": None if gravity == "known" else vertical,
        "crop": region or None,
        "scale": scale or None,
    }
    return {name: value for name, value in told.items() if value is not None}


def _region(text: str, option: str, counts: tuple[int, ...], words: str) -> tuple[float, ...]:
    numbers = _numbers(text, option, counts, words)
    low, high = ((0.0,), numbers) if len(numbers) == 1 else (numbers[:3], numbers[3:])
    if not all(a < b for a, b in zip(low, high, strict=True)):
        raise ValueError(f"{option} {text}: there is nothing inside; give {words}")
    return numbers


def _numbers(text: str, option: str, counts: tuple[int, ...], words: str) -> tuple[float, ...]:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) not in counts:
        raise ValueError(f"{option} {text}: give {words}")
    return numbers


def selections(
    paths: tuple[Path, Path], topic: str | None, index: str | None, at: str | None, accumulate: str | None
) -> list[Selection]:
    """Which cloud of the source's file and which of the target's, each by those options that its kind of file has.

    Raises
    ------
    ValueError
        A value that is none, or an option that concerns neither file.
    """
    from hybridreg.io.point_files import choices_in
    from hybridreg.io.recorded.recording import Selection

    told: list[dict[str, Any]] = [{}, {}]
    known = [choices_in(path) for path in paths]
    for name, text, kind, words in (
        ("topic", topic, str, "name"),
        ("index", index, int, "whole number"),
        ("at", at, float, "number of seconds"),
        ("accumulate", accumulate, int, "whole number"),
    ):
        if text is None:
            continue
        parts = text.split(",")
        try:
            values = [kind(part) for part in parts]
        except ValueError:
            values = []
        if len(values) not in (1, 2):
            raise ValueError(
                f"--{name} {text}: give one {words} for both clouds, or the source's and the target's with a comma"
            )
        if not any(name in each for each in known):
            raise ValueError(f"--{name} {text}: chooses nothing in {paths[0]} and {paths[1]}; leave it out")
        for side, its, value in zip(told, known, values * (2 // len(values)), strict=True):
            if value != "" and name in its:
                side[name] = value
    return [Selection(**each) for each in told]


def both(text: str | None, option: str) -> tuple[str, str]:
    """One text for the source and one for the target, with a comma between; empty where nothing was given."""
    if text is None:
        return "", ""
    source, comma, target = text.partition(",")
    if not comma or "," in target:
        raise ValueError(
            f"{option} {text}: give two names with one comma, such as {option} 'Livox Avia,HDL-64E'"
        )
    return source.strip(), target.strip()


def check_form(form: str) -> None:
    """Refuse a form that no pose is written in."""
    from hybridreg.output.pose_text import FORMATS

    if form not in FORMATS:
        raise ValueError(f"--format {form}: a pose is written as {', '.join(FORMATS)}")


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
