# SPDX-License-Identifier: MIT
"""A table: several methods on the same pairs, run once and stored in a folder."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from hybridreg.data.dataset import vouch
from hybridreg.data.yaw_starts import YawStarts
from hybridreg.eval.run.prediction import predict
from hybridreg.eval.run.row import Row
from hybridreg.eval.scored_table import Table
from hybridreg.eval.stored_table import INDEX, file_of, load, read_index
from hybridreg.eval.table_file import Recipe
from hybridreg.io import shipped_weights, write_json
from hybridreg.io.lock import folder_lock
from hybridreg.pair import LabelledPair
from hybridreg.runtime import optional_packages


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
    folder.mkdir(parents=True, exist_ok=True)
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
                file_of(folder, name),
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
    _tell_of_lines_no_longer_listed(folder, lines)
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
    write_json(folder / INDEX, index)
    return load(folder)


def _tell_of_lines_no_longer_listed(folder: Path, lines: Sequence[str]) -> None:
    # Their predictions stay, but no report of this folder shows them any more.
    try:
        before = read_index(folder).lines
    except (FileNotFoundError, ValueError):
        return
    gone = [name for name in before if name not in lines and file_of(folder, name).is_file()]
    if gone:
        one = file_of(folder, gone[0])
        warnings.warn(
            f"{folder} held a table with {', '.join(gone)}, which this one does not list; what was predicted is kept: "
            f"`hybridreg report {one} {file_of(folder, lines[0])}` compares them; give each run a folder of its own",
            UserWarning,
            stacklevel=4,
        )


def _visits(methods: Mapping[str, Any]) -> dict[str, int]:
    # Stored with the rows: the weights of that name may be others when the report is written again.
    found = {name: shipped_weights.visits_of(method) for name, method in methods.items()}
    return {name: count for name, count in found.items() if count is not None}
