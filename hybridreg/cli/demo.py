# SPDX-License-Identifier: MIT
"""`hybridreg demo`: registration of a pair that comes with the library."""

from __future__ import annotations

from importlib.resources import as_file, files
from pathlib import Path
from typing import Annotated

import typer

from hybridreg.cli import options, outputs
from hybridreg.cli.register import show
from hybridreg.cli.terminal.error_messages import VERDICT_FAILED, plainly
from hybridreg.cli.terminal.typed_command import typed


@plainly
def command(
    context: typer.Context,
    out: Annotated[Path, typer.Option(help="Folder for the pair, pose, result, page and picture.")] = Path(
        "out/demo"
    ),
    preset: options.Preset = None,
    seed: options.Seed = 0,
) -> None:
    """Align the embedded pair of clouds and compare with its true pose; leave the pair itself too, to try things on."""
    from hybridreg.changes import build
    from hybridreg.data.loaders.folder import load_pair
    from hybridreg.eval.report import single_report
    from hybridreg.eval.score import metrics
    from hybridreg.io import write_bytes, write_points

    outputs.check_folder(out)
    method = build(options.changes_of(preset, None, None, None))
    with as_file(files("hybridreg.data").joinpath("demo")) as folder:
        labelled = load_pair(folder)
        image = folder / "image.jpg"
        photo = image.read_bytes() if image.is_file() else None
    pair = labelled.pair
    kinds = f"{pair.meta.get('source_sensor', 'source')} -> {pair.meta.get('target_sensor', 'target')}"
    print(f"{kinds}: {len(pair.source)} and {len(pair.target)} points")
    result = method.run(pair, seed=seed)
    show(result)
    rre = metrics.rre_deg(result.transformation, labelled.T_target_source)
    rte = metrics.rte_m(result.transformation, labelled.T_target_source)
    print(f"against the true pose: {rre:.2f} deg, {rte:.2f} m")
    origin = single_report.Origin("fan.ply", "rings.ply", command=typed(context))
    written = single_report.write(pair, result, out, origin)
    for name, cloud in (("fan.ply", pair.source), ("rings.ply", pair.target)):
        write_points(out / name, cloud.points + cloud.offset)
        written.append(out / name)
    if photo is not None:
        write_bytes(out / "front.jpg", photo)
        written.append(out / "front.jpg")
    print(f"written to {out}: {', '.join(file.name for file in written)}")
    if result.verdict == "failed":
        raise typer.Exit(VERDICT_FAILED)
