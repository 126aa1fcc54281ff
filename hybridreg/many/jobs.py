# SPDX-License-Identifier: MIT
"""Which clouds a batch registers to which: a list in a CSV file, or a pattern of names and one target."""

from __future__ import annotations

import csv
import glob
import os
from pathlib import Path
from typing import NamedTuple

from hybridreg.io.faults import fault


class Job(NamedTuple):
    """One pair of files, and what it is called."""

    id: str
    source: str
    target: str


def jobs_of(what: str, target: str | os.PathLike[str] | None) -> list[Job]:
    """The pairs of a batch.

    Parameters
    ----------
    what : a `.csv` file with the columns `source`, `target` (may be left out where one is given) and perhaps `id`, its
        paths counted from its own folder; or a pattern of source files such as `scans/*.pcd`
    target : the target of all that name none

    Raises
    ------
    FileNotFoundError
        No such list, or no file fits the pattern.
    ValueError
        A row without a source or a target, or two of one id; the message tells the row.
    """
    jobs = _listed(Path(what), target) if what.lower().endswith(".csv") else _found(what, target)
    seen: set[str] = set()
    for job in jobs:
        if job.id in seen:
            raise fault(
                what, f"two pairs are called {job.id!r}", "give each another id, in a column of that name"
            )
        seen.add(job.id)
    return jobs


def _found(pattern: str, target: str | os.PathLike[str] | None) -> list[Job]:
    files = sorted(glob.glob(pattern, recursive=True))
    if not files:
        raise FileNotFoundError(f"{pattern}: no file fits this pattern (the current folder is {Path.cwd()})")
    if target is None:
        raise ValueError(
            f"{pattern}: a pattern names sources only; give their target: target=..., on the command line --target"
        )
    rest = [file for file in files if not _same(file, os.fspath(target))]
    if not rest:
        raise ValueError(f"{pattern}: fits the target alone; give a pattern of sources")
    names = [Path(file).stem for file in rest]
    unique = len(set(names)) == len(names)
    return [
        Job(name if unique else file, file, os.fspath(target)) for name, file in zip(names, rest, strict=True)
    ]


def _same(one: str, other: str) -> bool:
    return os.path.abspath(one) == os.path.abspath(other)


def _listed(path: Path, target: str | os.PathLike[str] | None) -> list[Job]:
    if not path.is_file():
        raise FileNotFoundError(f"{path}: no such list")
    try:
        rows = list(csv.DictReader(path.read_text(encoding="utf-8-sig").splitlines()))
    except (UnicodeDecodeError, csv.Error) as error:
        raise fault(str(path), f"is no table ({error})", "save it as CSV in UTF-8") from error
    jobs = []
    for number, row in enumerate(rows, start=2):
        cells = {
            (key or "").strip().lower(): (value or "").strip()
            for key, value in row.items()
            if isinstance(value, str)
        }
        source, own = cells.get("source", ""), cells.get("target", "")
        if not source or not (own or target):
            lacking = "source" if not source else "target"
            cure = "it needs the columns source and target, or source and a target for all"
            raise fault(str(path), f"row {number} names no {lacking}", cure)
        # As it is where it is a whole path: joining leaves those alone.
        goal = os.fspath(path.parent / own) if own else os.fspath(target or "")
        jobs.append(
            Job(
                cells.get("id") or f"{number - 1:04d}-{Path(source).stem}",
                os.fspath(path.parent / source),
                goal,
            )
        )
    if not jobs:
        raise fault(str(path), "holds no rows", "give one pair a row, below the columns source and target")
    return jobs
