# SPDX-License-Identifier: MIT
"""Files of many clouds into one frame, and all that is told of it into a folder; what was cut off goes on."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hybridreg import changes
from hybridreg.cloud import PointCloud
from hybridreg.geometry import se3
from hybridreg.io import write_points
from hybridreg.io.atomic import write_text
from hybridreg.io.csv_cells import csv_text
from hybridreg.io.lock import folder_lock
from hybridreg.io.write import write_json
from hybridreg.many.alignment import Alignment
from hybridreg.many.alignment_words import against_clouds
from hybridreg.many.file_patterns import files_named
from hybridreg.many.link_file import LinkFile
from hybridreg.many.link_search import aligned
from hybridreg.output.pose_files import pose_files
from hybridreg.output.pose_text import FORMATS, position_and_quaternion

WRITTEN = _LINKS, _TABLE, _ROLES, _ALL = "links.jsonl", "poses.csv", "links.csv", "alignment.json"


def files_of(what: Sequence[str]) -> list[str]:
    """Files of clouds, two or more, by their paths or patterns (`file_patterns.files_named`).

    Raises
    ------
    FileNotFoundError
        No file fits a pattern.
    ValueError
        One file, one that is named twice, or a folder of clouds.
    """
    files = files_named(what)
    if len(files) < 2:
        raise ValueError(
            f"{' '.join(what)}: one cloud, two or more are needed; give a pattern in quotes, or more paths"
        )
    twice = [file for file in files if sum(os.path.samefile(file, other) for other in files) > 1]
    if twice:
        raise ValueError(f"{twice[0]}: named twice; give each cloud once")
    return files


def run(
    files: Sequence[str],
    out: str | os.PathLike[str],
    how: Mapping[str, Any],
    *,
    ordered: bool = True,
    reference: str | None = None,
    seed: int = 0,
    workers: int | None = None,
    overwrite: bool = False,
    nonfinite: Literal["raise", "drop"] = "raise",
    viewpoint: Any = "auto",
    form: str = "matrix",
    merged: str | os.PathLike[str] | None = None,
    on_link: Callable[[], None] = lambda: None,
) -> Alignment:
    """Align the clouds of `files` (`hybridreg.register_all`) and write into the folder `out`.

    `links.jsonl` grows as pairs are registered; at the end `poses.csv` has a row for each cloud, `links.csv` one for
    each pair, its verdict and what became of it, `alignment.json` has all that in one, and the poses are written as
    `form` says (`pose_files`).

    Parameters
    ----------
    how : what `hybridreg.changes.build` takes: a preset or pipeline, and what differs from it
    reference : the cloud whose frame all others get, by its name or file; the first
    viewpoint : of every cloud, as `PointCloud.of` takes it
    merged : a `.ply` or `.pcd` file for all placed clouds in one

    Raises
    ------
    ValueError, FileNotFoundError
        A cloud that cannot be read or registered, by its name; a reference that is none; the folder holds links of
        other settings, or another process writes there.
    ImportError
        Without open3d, or a package that the pipeline needs.
    """
    names = _names(files)
    row = _row_of(reference, names, files)
    pipeline = changes.build(how)
    settings = {"pipeline": pipeline.to_spec(), "seed": seed, "nonfinite": nonfinite}
    settings["viewpoint"] = list(viewpoint) if isinstance(viewpoint, tuple) else viewpoint
    clouds = [
        PointCloud.of(file, name=name, nonfinite=nonfinite, viewpoint=viewpoint)
        for file, name in zip(files, names, strict=True)
    ]
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    with folder_lock(folder):
        with closing(
            LinkFile(folder / _LINKS, files, settings, overwrite=overwrite, on_link=on_link)
        ) as memory:
            found = aligned(
                clouds,
                names,
                pipeline,
                ordered=ordered,
                reference=row,
                seed=seed,
                workers=workers,
                memory=memory,
            )
        write_text(folder / _TABLE, _table(found, files))
        write_text(folder / _ROLES, _roles(found))
        write_json(folder / _ALL, found.to_dict())
        # A cloud that an earlier run placed may not be placed now, and poses in another form are of that run.
        forms = (path for each in FORMATS for path in folder.glob(f"poses.{each}*"))
        for stale in (*(folder / "poses").glob("*.txt"), *forms):
            stale.unlink()
        for name, text in pose_files(names, found.poses, row, form).items():
            (folder / name).parent.mkdir(exist_ok=True)
            write_text(folder / name, text)
        if merged is not None:
            write_points(merged, merged_points(clouds, found))
    return found


def merged_points(clouds: Sequence[PointCloud], found: Alignment) -> Any:
    """All points of the placed clouds, (N, 3), in the reference's coordinates."""
    return np.vstack(
        [
            se3.apply(pose, cloud.points + cloud.offset)
            for cloud, pose, placed in zip(clouds, found.poses, found.placed, strict=True)
            if placed
        ]
    )


def _names(files: Sequence[str]) -> tuple[str, ...]:
    stems = [Path(file).stem for file in files]
    return tuple(stems if len(set(stems)) == len(stems) else files)


def _row_of(reference: str | None, names: Sequence[str], files: Sequence[str]) -> int:
    if reference is None:
        return 0
    for row, (name, file) in enumerate(zip(names, files, strict=True)):
        if reference in (name, file, os.path.basename(file)):
            return row
    raise ValueError(
        f"reference {reference!r}: is none of the clouds; they are {', '.join(names[:10])}"
        + (" ..." if len(names) > 10 else "")
    )


def _table(found: Alignment, files: Sequence[str]) -> str:
    rows = [["id", "file", "placed", "links", "x", "y", "z", "qx", "qy", "qz", "qw", "why"]]
    links, why = found.n_links, against_clouds(found)
    for row, (name, T, placed) in enumerate(zip(found.names, found.poses, found.placed, strict=True)):
        pose = position_and_quaternion(T) if placed else [""] * 7
        rows.append(
            [name, files[row], "yes" if placed else "no", str(links[row]), *pose, "; ".join(why[row])]
        )
    return csv_text(rows)


def _roles(found: Alignment) -> str:
    rows = [["source", "target", "verdict", "confidence", "role"]]
    for link in found.links:
        pair = found.names[link.source], found.names[link.target]
        rows.append([*pair, link.verdict, f"{link.confidence:.3f}", link.role])
    return csv_text(rows)
