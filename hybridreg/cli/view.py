# SPDX-License-Identifier: MIT
"""`hybridreg view A B [POSE]`: two clouds in 3-D, in a browser tab."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from hybridreg.cli import options, outputs
from hybridreg.cli.terminal.error_messages import plainly

# Points of a cloud that a phone turns without stuttering: a page of 2 MB.
_POINTS = 100_000
# By how much R R^T of a pose may be off that was typed with two decimals: a little more than of one that is searched
# around (`hybridreg.prior`), as it is only looked at.
_ROUNDED = 0.05


@plainly
def command(
    source: Annotated[Path, typer.Argument(help="The cloud that moves: ply, pcd, npy, las, e57, a bag ...")],
    target: Annotated[Path, typer.Argument(help="The cloud that stays.")],
    pose: Annotated[
        Path | None,
        typer.Argument(
            help="A file of a pose in any form of `register --format`, or a result.json; none: as they are."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Write the page here, instead of opening it in the browser.")
    ] = None,
    points: Annotated[int, typer.Option(min=1, help="Points drawn of each cloud, at most.")] = _POINTS,
    topic: options.Topic = None,
    index: options.Index = None,
    at: options.At = None,
    accumulate: options.Accumulate = None,
) -> None:
    """Show two clouds in 3-D at a pose, the source coloured by its distance to the target."""
    import numpy as np

    from hybridreg.cloud import PointCloud
    from hybridreg.eval.report import orbit_view
    from hybridreg.geometry import se3
    from hybridreg.io import write_text
    from hybridreg.io.poses.pose_file import read_pose
    from hybridreg.pair import Pair
    from hybridreg.prior.placing import sized

    if out is not None and out.suffix.lower() not in (".html", ".htm"):
        raise ValueError(f"--out {out}: the view is a page; choose a name such as {out.stem or 'view'}.html")
    outputs.check_file(out)
    T = np.eye(4)
    if pose is not None:
        T = se3.rounded(read_pose(pose), str(pose), _ROUNDED)
    select = options.selections((source, target), topic, index, at, accumulate)
    moving, still = (
        PointCloud.of(path, name=name, nonfinite="drop", select=choice)
        for name, path, choice in zip(("source", "target"), (source, target), select, strict=True)
    )
    pair = Pair.of(sized(moving, _scale(pose)), still)
    text = orbit_view.pair_page(pair, T, f"{source.name} onto {target.name}", points)
    if out is not None:
        write_text(out, text)
        print(f"written: {out}")
        return
    _open(text)


def _scale(pose: Path | None) -> float:
    """What a stored result says that the source must be multiplied by first."""
    from hybridreg.io.structured import read_json

    if pose is None or pose.suffix.lower() != ".json":
        return 1.0
    stored = read_json(pose)
    scale = stored.get("scale", 1.0) if isinstance(stored, dict) else 1.0
    if not isinstance(scale, (int, float)) or not 0.0 < scale < float("inf"):
        raise ValueError(
            f"{pose}: scale {scale!r} is no positive number; write the pose as a 4x4 matrix alone"
        )
    return float(scale)


def _open(text: str) -> None:
    """Show a page in the browser; it stays in the folder of temporary files, as the browser reads it later."""
    import tempfile
    import webbrowser

    from hybridreg.io import write_text

    path = Path(tempfile.mkdtemp(prefix="hybridreg-view-")) / "view.html"
    write_text(path, text)
    shown = webbrowser.open(path.as_uri())
    print(f"{'opened' if shown else 'no browser was found; open this page yourself'}: {path}")
