# SPDX-License-Identifier: MIT
"""A table: several methods on the same pairs, run once and stored in a folder."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hybridreg.config.plain_values import build
from hybridreg.data.dataset import vouch
from hybridreg.data.yaw_starts import YawStarts
from hybridreg.eval.run import store
from hybridreg.eval.run.prediction import predict
from hybridreg.eval.run.row import Row
from hybridreg.eval.score import paper, scoring
from hybridreg.eval.scored_table import IDENTITY, Entry, Table
from hybridreg.eval.table_file import Recipe, slug
from hybridreg.io import shipped_weights, write_json
from hybridreg.io.lock import folder_lock
from hybridreg.io.structured import read_json
from hybridreg.pair import LabelledPair
from hybridreg.runtime import optional_packages

_INDEX = "table.json"
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
            raise ValueError(f"{_INDEX}: starts {self.starts} must be 0 or more")


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


def run(
    recipe: Recipe,
    pairs: Sequence[LabelledPair],
    out: str | os.PathLike[str],
    *,
    data: str = "",
    workers: int | None = None,
    overwrite: bool = False,
    on_row: Callable[[str, Row], None] | None = None,
) -> Table:
    """Run every row of a table file; what `out` already holds is not run again.

    Parameters
    ----------
    pairs : the data without the yaw rotations that the file asks for
    out : folder; the rows go to `out/predictions/<line>.jsonl`
    on_row : called with each line's name and row

    Raises
    ------
    InUse
        Another process is writing into `out`.
    ValueError
        No line can be run, `out` holds predictions of another configuration, or the poses map target to source.
    OSError
        `out` cannot be written to, or the disk is full; rows that are done are kept.
    """
    if all(line.method is None for line in recipe.lines):
        raise ValueError(
            f"none of {len(recipe.lines)} lines can be run; the first: {recipe.lines[0].problem}"
        )
    vouch(pairs)
    folder = Path(out)
    (folder / _PREDICTIONS).mkdir(parents=True, exist_ok=True)
    with folder_lock(folder):
        return _run(recipe, pairs, folder, data, workers, overwrite, on_row)


def _run(
    recipe: Recipe,
    pairs: Sequence[LabelledPair],
    folder: Path,
    data: str,
    workers: int | None,
    overwrite: bool,
    on_row: Callable[[str, Row], None] | None,
) -> Table:
    tried = YawStarts(pairs, recipe.starts, recipe.seed) if recipe.starts else pairs
    problems = {line.name: line.problem for line in recipe.lines if line.method is None}
    lines: list[str] = []
    for name, method in ((line.name, line.method) for line in recipe.lines if line.method is not None):
        heard = None if on_row is None else lambda row, name=name: on_row(name, row)
        try:
            predict(
                method,
                tried,
                _file(folder, name),
                seed=recipe.seed,
                workers=workers,
                overwrite=overwrite,
                data=data,
                on_row=heard,
            )
        except ImportError as error:
            problems[name] = " ".join(str(error).split())
        else:
            lines.append(name)
    if not lines:
        name, problem = next(iter(problems.items()))
        raise ValueError(f"none of {len(problems)} lines can be run here; the first, {name}: {problem}")
    methods = {line.name: line.method for line in recipe.lines}
    index: dict[str, Any] = {
        "title": recipe.title,
        "data": data,
        "seed": recipe.seed,
        "starts": recipe.starts,
        "protocols": [protocol.name for protocol in recipe.protocols],
        "lines": lines,
        "problems": problems,
        "left_out": {name: text for name in lines if (text := optional_packages.left_out(methods[name]))},
        "visits": _visits({name: methods[name] for name in lines}),
        "paper": None if recipe.paper is None else recipe.paper.to_dict(),
    }
    write_json(folder / _INDEX, index)
    return load(folder)


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
    entries = [_entry(name, _file(Path(folder), name)) for name in index.lines]
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
        starts=0,
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
    path = Path(folder) / _INDEX
    if not path.is_file():
        raise FileNotFoundError(f"{os.fspath(folder)}: no table was run there; run `hybridreg table` first")
    return build(Index, read_json(path), str(path))


def _visits(methods: Mapping[str, Any]) -> dict[str, int]:
    # Stored with the rows: the weights of that name may be others when the report is written again.
    found = {name: shipped_weights.visits_of(method) for name, method in methods.items()}
    return {name: count for name, count in found.items() if count is not None}


def _entry(name: str, path: Path) -> Entry:
    read = store.read(path)
    return Entry(name=name, rows=read.rows, config=read.config)


def files_in(path: Path) -> list[Path]:
    """The predictions in a folder that `run` wrote; of a file that itself.

    Raises
    ------
    ValueError
        The folder holds none.
    """
    found = sorted((path / _PREDICTIONS).glob("*.jsonl")) if path.is_dir() else [path]
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


def _file(folder: Path, name: str) -> Path:
    return folder / _PREDICTIONS / f"{slug(name)}.jsonl"
