# SPDX-License-Identifier: MIT
"""`hybridreg register A B`: align two clouds."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hybridreg.cli import options
from hybridreg.cli.command_line_cures import spoken
from hybridreg.cli.error_messages import VERDICT_FAILED, plainly

if TYPE_CHECKING:
    from hybridreg.result import RegistrationResult


class NonFinite(str, Enum):
    """How points that are not finite are treated."""

    refuse = "raise"
    drop = "drop"


class Up(str, Enum):
    """Whether both clouds stand on the same side of their ground."""

    known = "known"
    unknown = "unknown"


@plainly
def command(
    source: Annotated[Path, typer.Argument(help="The cloud that moves: ply, pcd, npy, npz, bin, las, txt.")],
    target: Annotated[Path, typer.Argument(help="The cloud that stays.")],
    image: Annotated[Path | None, typer.Option(help="A camera image of the common view.")] = None,
    preset: options.Preset = None,
    pipeline: options.PipelineFile = None,
    settings: options.Settings = None,
    voxel: options.Voxel = None,
    seed: options.Seed = 0,
    out: Annotated[Path | None, typer.Option(help="Folder for pose, result, page and picture.")] = None,
    nonfinite: Annotated[NonFinite, typer.Option(help="Points that are not finite.")] = NonFinite.refuse,
    source_viewpoint: options.Viewpoint = "auto",
    target_viewpoint: options.Viewpoint = "auto",
    gravity: Annotated[Up, typer.Option(help="'unknown' where one cloud may be upside down.")] = Up.known,
) -> None:
    """Align two point clouds; print the pose, the verdict on it, and the seconds of each stage."""
    from hybridreg.changes import build
    from hybridreg.pair import Pair

    method = build(options.changes_of(preset, pipeline, settings, voxel))
    pair = Pair.of(
        source,
        target,
        image,
        nonfinite="drop" if nonfinite is NonFinite.drop else "raise",
        source_viewpoint=options.viewpoint(source_viewpoint, "--source-viewpoint"),
        target_viewpoint=options.viewpoint(target_viewpoint, "--target-viewpoint"),
        gravity="unknown" if gravity is Up.unknown else "known",
    )
    result = method.run(pair, seed=seed)
    show(result)
    if out is not None:
        from hybridreg.eval.report import single_report

        files = single_report.write(pair, result, out)
        print(f"written to {out}: {', '.join(file.name for file in files)}")
    if result.verdict == "failed":
        raise typer.Exit(VERDICT_FAILED)


def show(result: RegistrationResult) -> None:
    """Print a result."""
    print("T_target_source, metres:")
    for row in result.transformation:
        print("  " + " ".join(f"{value:14.9f}" for value in row))
    print(f"verdict: {result.verdict} (confidence {result.confidence:.2f})")
    for reason in result.reasons:
        print(f"  - {reason}")
    for note in result.notes:
        print(f"note: {spoken(note)}")
    stages = ", ".join(f"{stage} {seconds:.3f}" for stage, seconds in result.seconds.items())
    print(f"seconds: {stages}; together {sum(result.seconds.values()):.3f}")
