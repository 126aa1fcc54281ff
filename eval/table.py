# SPDX-License-Identifier: MIT
"""A table: several methods on the same pairs, run once and kept in a folder."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hybridreg.data.starts import YawStarts
from hybridreg.eval import paper, scoring, store
from hybridreg.eval.paper import Printed
from hybridreg.eval.prediction import predict
from hybridreg.eval.protocols import Protocol
from hybridreg.eval.recipe import Recipe, slug
from hybridreg.eval.row import Row
from hybridreg.io import write_json
from hybridreg.pair import LabelledPair

IDENTITY = "identity"
_INDEX = "table.json"


@dataclass(frozen=True, eq=False, kw_only=True)
class Entry:
    """One method's rows; `config` is what made them."""

    name: str
    rows: list[Row]
    config: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False, kw_only=True)
class Table:
    """Methods side by side.

    Attributes
    ----------
    entries : the identity first, then the methods
    starts : turned copies of each pair
    problems : lines that could not be built, with the reason
    paper : figures that somebody printed, to be shown apart
    """

    title: str
    data: str
    seed: int
    starts: int
    entries: list[Entry]
    problems: dict[str, str] = field(default_factory=dict)
    paper: Printed | None = None

    @property
    def methods(self) -> list[Entry]:
        """The entries but the identity."""
        return [entry for entry in self.entries if entry.name != IDENTITY]

    def scores(self, protocol: Protocol) -> dict[str, scoring.Score]:
        """Score of every entry that has rows."""
        return {entry.name: scoring.score(entry.rows, protocol) for entry in self.entries if entry.rows}

    def caption(self, protocol: Protocol) -> str:
        """Which number is this: the data, the starts, the protocol."""
        n = max((len(entry.rows) for entry in self.entries), default=0)
        runs = f"{n} pairs"
        if self.starts:
            runs = f"{n // (self.starts + 1)} pairs, each as it is and under {self.starts} random yaw starts, {n} runs"
        return f"{self.title}. Data {self.data or 'unnamed'}, {runs}; {protocol.describe()}"


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
    """Run every line of a recipe; what `out` already holds is not run again.

    Parameters
    ----------
    pairs : the data without the yaw starts that the recipe asks for
    out : folder; the rows go to `out/predictions/<line>.jsonl`
    on_row : called with each line's name and row

    Raises
    ------
    ValueError
        No line can be run, or `out` holds predictions of another configuration.
    """
    if all(line.method is None for line in recipe.lines):
        raise ValueError(
            f"none of {len(recipe.lines)} lines can be run; the first: {recipe.lines[0].problem}"
        )
    folder = Path(out)
    (folder / "predictions").mkdir(parents=True, exist_ok=True)
    tried = YawStarts(pairs, recipe.starts, recipe.seed) if recipe.starts else pairs
    lines = {line.name: line.method for line in recipe.lines if line.method is not None}
    for name, method in lines.items():
        heard = None if on_row is None else lambda row, name=name: on_row(name, row)
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
    index = {
        "title": recipe.title,
        "data": data,
        "seed": recipe.seed,
        "starts": recipe.starts,
        "protocols": [protocol.name for protocol in recipe.protocols],
        "lines": list(lines),
        "problems": {line.name: line.problem for line in recipe.lines if line.method is None},
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
    """
    index = read_index(folder)
    entries = [_entry(name, _file(Path(folder), name)) for name in index["lines"]]
    return Table(
        title=index["title"],
        data=index["data"],
        seed=index["seed"],
        starts=index["starts"],
        problems=index["problems"],
        paper=paper.parse(index["paper"]) if index.get("paper") else None,
        entries=_with_identity(entries),
    )


def of_files(paths: Sequence[str | os.PathLike[str]]) -> Table:
    """A table of single files of predictions, named after the files.

    Raises
    ------
    ValueError
        The files are not of the same data.
    """
    entries = [_entry(Path(path).stem, Path(path)) for path in paths]
    data = entries[0].config["data"]
    for entry, path in zip(entries, paths, strict=True):
        if entry.config["data"]["fingerprint"] != data["fingerprint"]:
            raise ValueError(
                f"{os.fspath(path)} is of other data than {os.fspath(paths[0])}: "
                f"{entry.config['data']['name']} and {data['name']}; compare files of the same data"
            )
    seed = entries[0].config["seed"]
    return Table(title="Predictions", data=data["name"], seed=seed, starts=0, entries=_with_identity(entries))


def read_index(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """What `run` noted of a table."""
    path = Path(folder) / _INDEX
    if not path.is_file():
        raise FileNotFoundError(f"{os.fspath(folder)}: no table was run there; run `hybridreg table` first")
    index: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return index


def _entry(name: str, path: Path) -> Entry:
    read = store.read(path)
    return Entry(name=name, rows=read.rows, config=read.config)


def _with_identity(entries: list[Entry]) -> list[Entry]:
    longest = max((entry.rows for entry in entries), key=len, default=[])
    return [Entry(name=IDENTITY, rows=scoring.identity(longest)), *entries]


def _file(folder: Path, name: str) -> Path:
    return folder / "predictions" / f"{slug(name)}.jsonl"
