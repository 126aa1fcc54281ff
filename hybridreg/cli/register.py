# SPDX-License-Identifier: MIT
"""`hybridreg register A B`: align two clouds."""

from __future__ import annotations

import os
import warnings
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from hybridreg.cli import options, outputs
from hybridreg.cli.terminal.command_line_cures import spoken
from hybridreg.cli.terminal.error_messages import VERDICT_FAILED, plainly
from hybridreg.cli.terminal.typed_command import typed

if TYPE_CHECKING:
    from hybridreg.cloud import PointCloud
    from hybridreg.result import RegistrationResult


class NonFinite(str, Enum):
    """How points that are not finite are treated."""

    refuse = "raise"
    drop = "drop"


@plainly
def command(
    context: typer.Context,
    source: Annotated[Path, typer.Argument(help="The cloud that moves: ply, pcd, npy, las, e57, a bag ...")],
    target: Annotated[Path, typer.Argument(help="The cloud that stays.")],
    image: Annotated[Path | None, typer.Option(help="A camera image of the common view.")] = None,
    preset: options.Preset = None,
    pipeline: options.PipelineFile = None,
    settings: options.Settings = None,
    voxel: options.Voxel = None,
    seed: options.Seed = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for pose, result, report and picture.")] = None,
    sensors: Annotated[
        str | None, typer.Option(metavar="NAME,NAME", help="The source's and the target's, for the report.")
    ] = None,
    aligned: Annotated[
        Path | None, typer.Option(help="Write the source, moved onto the target: ply or pcd.")
    ] = None,
    merged: Annotated[Path | None, typer.Option(help="Write both clouds as one: ply or pcd.")] = None,
    form: options.Format = "matrix",
    nonfinite: Annotated[NonFinite, typer.Option(help="Points that are not finite.")] = NonFinite.refuse,
    topic: options.Topic = None,
    index: options.Index = None,
    at: options.At = None,
    accumulate: options.Accumulate = None,
    source_viewpoint: options.Viewpoint = "auto",
    target_viewpoint: options.Viewpoint = "auto",
    init: options.Init = None,
    max_translation: options.MaxTranslation = None,
    max_rotation: options.MaxRotation = None,
    gravity: options.Gravity = "known",
    crop: options.Crop = None,
    crop_source: options.CropSource = None,
    scale: options.Scale = False,
) -> None:
    """Align two point clouds; print the pose, the verdict on it, and the seconds of each stage."""
    from hybridreg.changes import build
    from hybridreg.cloud import PointCloud
    from hybridreg.io.point_files import choices_in
    from hybridreg.pair import Pair

    options.check_form(form)
    outputs.check_folder(out)
    outputs.check_clouds((aligned, merged), (source, target), out)
    source_sensor, target_sensor = options.both(sensors, "--sensors")
    if sensors is not None and out is None:
        raise ValueError(f"--sensors {sensors}: names them in the report; add --out, or leave it out")
    changes = options.changes_of(preset, pipeline, settings, voxel)
    known = options.prior(init, max_translation, max_rotation, gravity, crop, crop_source, scale)
    if known:
        changes["prior"] = {**changes.get("prior", {}), **known}
    method = build(changes)
    select = options.selections((source, target), topic, index, at, accumulate)
    if select[0] == select[1] and os.path.realpath(source) == os.path.realpath(target):
        cure = "choose another one for each: --index 0,1" if choices_in(source) else "name two files"
        warnings.warn(f"source and target are the same cloud of {source}; {cure}", UserWarning, stacklevel=1)
    missing: Literal["raise", "drop"] = "drop" if nonfinite is NonFinite.drop else "raise"
    clouds = [
        PointCloud.of(
            path,
            name=name,
            nonfinite=missing,
            viewpoint=options.viewpoint(place, f"--{name}-viewpoint"),
            select=choice,
        )
        for name, path, place, choice in zip(
            ("source", "target"), (source, target), (source_viewpoint, target_viewpoint), select, strict=True
        )
    ]
    pair = Pair.of(clouds[0], clouds[1], image)
    result = method.run(pair, seed=seed)
    show(result, form)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
    write_clouds(clouds, result, aligned, merged)
    if out is not None:
        from hybridreg.eval.report import single_report
        from hybridreg.io import write_text
        from hybridreg.output.pose_text import FORMATS

        origin = single_report.Origin(str(source), str(target), source_sensor, target_sensor, typed(context))
        files = single_report.write(pair, result, out, origin)
        for other in FORMATS:  # of an earlier run
            (out / f"pose.{other}.txt").unlink(missing_ok=True)
        if form != "matrix":  # which the report's folder has anyway
            files = [*files, out / f"pose.{form}.txt"]
            write_text(files[-1], result.format(form) + "\n")
        print(f"written to {out}: {', '.join(file.name for file in files)}")
    if result.verdict == "failed":
        raise typer.Exit(VERDICT_FAILED)


def write_clouds(
    clouds: list[PointCloud], result: RegistrationResult, aligned: Path | None, merged: Path | None
) -> None:
    """Write the aligned source, and both clouds as one, in the target's coordinates."""
    import numpy as np

    from hybridreg.io import write_points

    source, target = clouds
    if aligned is not None:
        write_points(aligned, result.apply(source))
        print(f"written: {aligned}")
    if merged is not None:
        write_points(merged, np.vstack([target.points + target.offset, result.apply(source)]))
        print(f"written: {merged}")


def show(result: RegistrationResult, form: str = "matrix") -> None:
    """Print a result, its pose in one of `hybridreg.output.pose_text.FORMATS`."""
    if form == "matrix":
        print("T_target_source, metres:")
        for row in result.transformation:
            print("  " + " ".join(f"{value:14.9f}" for value in row))
    else:
        print(f"T_target_source, metres, as {form}:")
        print(result.format(form))
    if result.scale_verdict is not None:
        print(f"scale: {result.scale:.5g} ({result.scale_verdict}); multiply the source by it first")
    print(f"verdict: {result.verdict} (confidence {result.confidence:.2f})")
    for reason in result.reasons:
        print(f"  - {spoken(reason)}")
    for note in result.notes:
        print(f"note: {spoken(note)}")
    if result.entries:
        from hybridreg.output import result_words

        print(f"found by: {result_words.found_by(result)}")
    stages = ", ".join(f"{stage} {seconds:.3f}" for stage, seconds in result.seconds.items())
    print(f"seconds: {stages}; together {sum(result.seconds.values()):.3f}")
