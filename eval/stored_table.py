# SPDX-License-Identifier: MIT
"""What a run of a table left on disk, read again: the folder of one table, or files of predictions to compare."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hybridreg.config.plain_values import build
from hybridreg.data.yaw_starts import starts_in
from hybridreg.eval.run import store
from hybridreg.eval.score import paper, scoring
from hybridreg.eval.scored_table import IDENTITY, Entry, Table
from hybridreg.eval.table_file import slug
from hybridreg.io.structured import read_json

INDEX = "table.json"
_PREDICTIONS = "predictions"


@dataclass(frozen=True, kw_only=True)
class Index:
    """What is stored of a table besides its predictions; `lines` are the names of the rows that were run."""

    title: str
    data: str
    seed: int
    starts: int
    protocols: tuple[str, ...]
    lines: tuple[str, ...]
    problems: Mapping[str, str]
    left_out: Mapping[str, str] = field(default_factory=dict)
    visits: Mapping[str, int] = field(default_factory=dict)
    paper: Mapping[str, Any] | None = None

    def __post_init__(self) -> None:
        if self.starts < 0:
            raise ValueError(f"{INDEX}: starts {self.starts} must be 0 or more")


@dataclass(frozen=True, kw_only=True)
class _MadeFrom:
    """The data that stored rows belong to."""

    name: str
    pairs: int
    fingerprint: str


@dataclass(frozen=True, kw_only=True)
class _Made:
    """What is asked of files of predictions in one table: the data must agree."""

    data: _MadeFrom
    seed: int


def load(folder: str | os.PathLike[str]) -> Table:
    """The table that `run` left in a folder.

    Raises
    ------
    FileNotFoundError
        No table was run there.
    ValueError
        A file there is damaged, or holds no row yet.
    """
    index = read_index(folder)
    entries = [_entry(name, file_of(Path(folder), name)) for name in index.lines]
    return Table(
        title=index.title,
        data=index.data,
        seed=index.seed,
        starts=index.starts,
        problems=dict(index.problems),
        left_out=dict(index.left_out),
        visits=dict(index.visits),
        paper=None if index.paper is None else paper.parse(index.paper),
        entries=_with_identity(entries),
    )


def of_files(paths: Sequence[str | os.PathLike[str]]) -> Table:
    """A table of single files of predictions, named after the files, and their folders where files share a name.

    Raises
    ------
    ValueError
        The files are not of the same data.
    """
    entries = [
        _entry(name, Path(path)) for name, path in zip(_names([*map(Path, paths)]), paths, strict=True)
    ]
    made = [
        build(_Made, {key: entry.config.get(key) for key in ("data", "seed")}, f"{os.fspath(path)}, line 1")
        for entry, path in zip(entries, paths, strict=True)
    ]
    for other, path in zip(made, paths, strict=True):
        if other.data.fingerprint != made[0].data.fingerprint:
            raise ValueError(
                f"{os.fspath(path)} is of other data than {os.fspath(paths[0])}: "
                f"{other.data.name} and {made[0].data.name}; compare files of the same data"
            )
    return Table(
        title="Predictions",
        data=made[0].data.name,
        seed=made[0].seed,
        starts=starts_in(row.id for entry in entries for row in entry.rows),
        entries=_with_identity(entries),
    )


def read_index(folder: str | os.PathLike[str]) -> Index:
    """What `run` stored of a table.

    Raises
    ------
    FileNotFoundError
        No table was run there.
    ValueError
        The file is damaged.
    """
    path = Path(folder) / INDEX
    if not path.is_file():
        raise FileNotFoundError(f"{os.fspath(folder)}: no table was run there; run `hybridreg table` first")
    return build(Index, read_json(path), str(path))


def _entry(name: str, path: Path) -> Entry:
    read = store.read(path)
    return Entry(name=name, rows=read.rows, config=read.config)


def files_in(path: Path) -> list[Path]:
    """The predictions in a folder that `run` wrote, those of its last table; of a file that itself.

    Raises
    ------
    ValueError
        The folder holds none.
    """
    if not path.is_dir():
        return [path]
    if (path / INDEX).is_file():
        return [file_of(path, name) for name in read_index(path).lines]
    found = sorted((path / _PREDICTIONS).glob("*.jsonl"))  # of a table that was interrupted
    if not found:
        raise ValueError(f"{path}: holds no predictions; give a folder that `hybridreg eval` wrote")
    return found


def _names(paths: Sequence[Path]) -> list[str]:
    # As short as they differ: the file's name, that and the run's folder, the whole path.
    own = [
        path.name if path.stem == IDENTITY else path.stem for path in paths
    ]  # the table has a row of that name
    runs = [path.parent.parent if path.parent.name == _PREDICTIONS else path.parent for path in paths]
    for names in (own, [f"{run.name}/{name}" for run, name in zip(runs, own, strict=True)]):
        if len(set(names)) == len(names):
            return names
    return [str(path) for path in paths]


def _with_identity(entries: list[Entry]) -> list[Entry]:
    longest = max((entry.rows for entry in entries), key=len, default=[])
    if not longest:
        raise ValueError("there are no rows yet; run `hybridreg table` or `hybridreg eval` to the end")
    return [Entry(name=IDENTITY, rows=scoring.identity(longest)), *entries]


def file_of(folder: Path, name: str) -> Path:
    """Where the predictions of a line are stored in a table's folder."""
    return folder / _PREDICTIONS / f"{slug(name)}.jsonl"
