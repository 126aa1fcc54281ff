# SPDX-License-Identifier: MIT
"""A batch of unlabelled pairs: poses and verdicts in a file that grows, so that what was cut off goes on."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from hybridreg import changes
from hybridreg.cloud import PointCloud
from hybridreg.io.atomic import write_text
from hybridreg.io.csv_cells import csv_text
from hybridreg.io.line_file import LineFile
from hybridreg.io.lock import folder_lock
from hybridreg.many.jobs import Job
from hybridreg.many.kept_rows import kept, looks
from hybridreg.many.target import Target
from hybridreg.output.pose_text import position_and_quaternion
from hybridreg.pair import Pair
from hybridreg.pipeline import Pipeline
from hybridreg.runtime.workers import spread

Row = dict[str, Any]
WRITTEN = _ROWS, _TABLE = "rows.jsonl", "poses.csv"
_COLUMNS = (
    "id",
    "source",
    "target",
    "verdict",
    "confidence",
    "x",
    "y",
    "z",
    "qx",
    "qy",
    "qz",
    "qw",
    "scale",
    "seconds",
    "why",
)


def run(
    jobs: Sequence[Job],
    out: str | os.PathLike[str],
    how: Mapping[str, Any],
    *,
    seed: int = 0,
    workers: int | None = None,
    overwrite: bool = False,
    nonfinite: str = "raise",
    target_viewpoint: Any = "auto",
    on_row: Callable[[Row], None] = lambda row: None,
    spoken: Callable[[str], str] = str,
) -> list[Row]:
    """Register every pair that the folder does not hold yet: `rows.jsonl` grows as they are done, `poses.csv` is
    written at the end. Pairs that ended with an `error` are tried again, as their files may have been mended since, and
    so are those of which a file has changed.

    Each target is prepared once in each process (`Target`). A pair that cannot be read or registered is a row with its
    `error`, and verdict "failed".

    Parameters
    ----------
    how : what `hybridreg.changes.build` takes: a preset or pipeline, and what differs from it
    workers : processes; None takes what `joblib.parallel_config` says, else 1
    spoken : how `poses.csv` tells an error, whose advice names arguments of Python

    Returns
    -------
    The rows in the order of the jobs.

    Raises
    ------
    ValueError
        The folder holds rows of other settings, or another process writes there.
    ImportError
        A package that the pipeline needs is not installed.
    """
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    settings = {"pipeline": changes.build(how).to_spec(), "seed": seed, "nonfinite": nonfinite}
    settings["target_viewpoint"] = (
        list(target_viewpoint) if isinstance(target_viewpoint, tuple) else target_viewpoint
    )
    with folder_lock(folder):
        path = folder / _ROWS
        done = {} if overwrite else _read(path, settings)
        # One target after another, so that each is prepared once.
        left = sorted((job for job in jobs if _key(job) not in done), key=lambda job: job.target)
        work = ((job, json.dumps(settings)) for job in left)
        with closing(LineFile(path, anew=not done)) as file:
            if not done:
                file.add(json.dumps(settings))
            for row in spread(_one, work, workers, singly=True):
                file.add(json.dumps(row))
                done[(row["id"], row["source"], row["target"])] = row
                on_row(row)
        rows = [done[_key(job)] for job in jobs]
        write_text(folder / _TABLE, _table(rows, spoken))
    return rows


def _key(job: Job) -> tuple[str, str, str]:
    return job.id, job.source, job.target


def _read(path: Path, settings: Row) -> dict[tuple[str, str, str], Row]:
    def parse(rows: list[Row]) -> tuple[dict[tuple[str, str, str], Row], int]:
        good = [row for row in rows if not row["error"] and _unchanged(row)]
        return {(row["id"], row["source"], row["target"]): row for row in good}, len(rows)

    found, n = kept(path, settings, parse) or ({}, 0)
    if len(found) < n:
        lines = (settings, *found.values())
        write_text(path, "".join(json.dumps(each) + "\n" for each in lines))
    return found


def _unchanged(row: Row) -> bool:
    # A file that is gone tells nothing against what was found with it.
    return all(now in (None, then) for now, then in zip(_looks(row), row["files"], strict=True))


def _looks(row: Row) -> list[str | None]:
    return [looks(file) if os.path.exists(file) else None for file in (row["source"], row["target"])]


@lru_cache(maxsize=1)
def _pipeline(settings: str) -> Pipeline:
    table = json.loads(settings)["pipeline"]
    return Pipeline(**table)


@lru_cache(maxsize=1)
def _target(path: str, seen: str | None, settings: str) -> Target:  # `seen`: it may change under its name
    told = json.loads(settings)
    return Target(path, nonfinite=told["nonfinite"], viewpoint=told["target_viewpoint"])


def _one(job: Job, settings: str) -> Row:
    row: Row = {
        **job._asdict(),
        "verdict": "failed",
        "confidence": 0.0,
        "T_target_source": None,
        "error": None,
    }
    row["files"] = _looks(row)  # before they are read
    told = json.loads(settings)
    try:
        source = PointCloud.of(job.source, name="source", nonfinite=told["nonfinite"])
        pair = Pair.of(source, _target(job.target, row["files"][1], settings), id=job.id)
        result = _pipeline(settings).run(pair, seed=told["seed"])
    except (ValueError, OSError, MemoryError) as error:
        return {
            **row,
            "error": " ".join(str(error).split()) or type(error).__name__,
            "reasons": [],
            "seconds": 0.0,
        }
    return {
        **row,
        "verdict": result.verdict,
        "confidence": result.confidence,
        "T_target_source": result.transformation.tolist(),
        "scale": result.scale,
        "reasons": list(result.reasons),
        "notes": list(result.notes),
        "seconds": sum(result.seconds.values()),
    }


def _table(rows: Sequence[Row], spoken: Callable[[str], str]) -> str:
    lines: list[Sequence[str]] = [_COLUMNS]
    for row in rows:
        T = row["T_target_source"]
        pose = [""] * 8 if T is None else [*position_and_quaternion(np.array(T)), f"{row['scale']:.6g}"]
        why = spoken(row["error"] or "; ".join(row["reasons"]))
        told = (row["id"], row["source"], row["target"], row["verdict"], f"{row['confidence']:.3f}")
        lines.append((*told, *pose, f"{row['seconds']:.3f}", why))
    return csv_text(lines)
