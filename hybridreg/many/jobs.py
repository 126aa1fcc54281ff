# SPDX-License-Identifier: MIT
"""Which clouds a batch registers to which: a list in a CSV file, or files and one target."""

from __future__ import annotations

import csv
import os
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from hybridreg.io.faults import fault
from hybridreg.many.file_patterns import files_named, is_pattern

# Other kinds of lists.
_NO_LISTS = (".json", ".jsonl", ".yaml", ".toml", ".xlsx")


class Job(NamedTuple):
    """One pair of files, and what it is called."""

    id: str
    source: str
    target: str


def jobs_of(what: Sequence[str], target: str | os.PathLike[str] | None) -> list[Job]:
    """The pairs of a batch.

    Parameters
    ----------
    what : one `.csv` file with the columns `source`, `target` (may be left out where one is given) and perhaps `id`,
        its paths counted from its own folder; or source files, by their paths or by patterns such as `scans/*.pcd`
    target : the target of all that name none

    Raises
    ------
    FileNotFoundError
        No such list or target, or no file fits a pattern.
    ValueError
        A row without a source or a target, or two of one id; the message tells the row.
    """
    told = " ".join(what)
    if target is not None and not os.path.exists(target):
        raise FileNotFoundError(f"{target}: no such target (the current folder is {Path.cwd()})")
    if told.lower().endswith(_NO_LISTS):
        raise ValueError(
            f"{told}: is no cloud; save a list of pairs as .csv, with the columns source, target, id"
        )
    is_list = len(what) == 1 and told.lower().endswith(".csv") and not is_pattern(told)
    jobs = _listed(Path(told), target) if is_list else _found(what, target)
    seen: set[str] = set()
    for job in jobs:
        if job.id in seen:
            raise fault(
                told, f"two pairs are called {job.id!r}", "give each another id, in a column of that name"
            )
        seen.add(job.id)
    return jobs


def _found(what: Sequence[str], target: str | os.PathLike[str] | None) -> list[Job]:
    files, told = files_named(what), " ".join(what)
    if target is None:
        problem = "names a source only" if len(files) == 1 else f"names {len(files)} sources only"
        raise ValueError(f"{told}: {problem}; give their target: target=..., on the command line --target")
    rest = [file for file in files if not _same(file, os.fspath(target))]
    if not rest:
        raise ValueError(f"{told}: fits the target alone; give a pattern of sources")
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
        lines = path.read_text(encoding="utf-8-sig").splitlines()
        # Spreadsheets write semicolons where the comma stands in decimals.
        delimiter = max(",;\t", key="".join(lines[:1]).count)
        rows = list(csv.DictReader(lines, delimiter=delimiter))
    except (UnicodeDecodeError, csv.Error) as error:
        raise fault(str(path), f"is no table ({error})", "save it as CSV in UTF-8") from error
    _warn_of_columns(rows, path)
    jobs = []
    for number, row in enumerate(rows, start=2):
        if any(row.pop(None, ())):  # where DictReader keeps what has no column
            cure = "put a name that holds the separator in quotes"
            raise fault(str(path), f"row {number} has more cells than the first row has columns", cure)
        cells = {(key or "").strip().lower(): (value or "").strip() for key, value in row.items()}
        source, own = cells.get("source", ""), cells.get("target", "")
        if not source or not (own or target):
            lacking = "source" if not source else "target"
            cure = "it needs the columns source and target, or source and a target for all"
            if {"x", "y", "z"} <= cells.keys():
                cure = f"if it is a cloud and no list of pairs, name it by a pattern, '{path.parent / path.stem}*.csv'"
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


def _warn_of_columns(rows: Sequence[Mapping[str, object]], path: Path) -> None:
    names = [key for key in (rows[0] if rows else ()) if key]
    useless = [key.strip() for key in names if key.strip().lower() not in Job._fields]
    # A list without a source is told as what it is.
    if useless and len(useless) < len(names):
        words = f"{path}: {', '.join(useless)}: not read; a list gives source, target and id of each pair, and no more"
        warnings.warn(words, UserWarning, stacklevel=4)
