# SPDX-License-Identifier: MIT
"""A table as a TOML file: the data, the protocols, a base pipeline, and what each row changes in it."""

from __future__ import annotations

import itertools
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from importlib.resources import files
from pathlib import Path
from typing import Any

from hybridreg import changes
from hybridreg.config.plain_values import build, value_of
from hybridreg.eval.run.attempt import Method
from hybridreg.eval.run.controls import MARK, Control
from hybridreg.eval.score import paper
from hybridreg.eval.score.paper import Printed
from hybridreg.eval.score.protocols import Protocol, protocol
from hybridreg.eval.scored_table import IDENTITY
from hybridreg.io.shipped_weights import MissingWeights
from hybridreg.io.structured import parse_toml, read_toml
from hybridreg.pipeline import Pipeline

Changes = Mapping[str, Any]

# Keys that make a row a control: a pipeline that knows more, or sees less, than a method does.
_CONTROLS = ("oracle", "image")


@dataclass(frozen=True, kw_only=True)
class _Content:
    """What a table file may hold."""

    title: str = ""
    data: str = ""
    protocols: tuple[str, ...] = ("cross3dreg", "kitti")
    seed: int = 0
    starts: int = 0
    base: Changes = field(default_factory=dict)
    row: tuple[Changes, ...] = ()
    sweep: Changes = field(default_factory=dict)
    paper: Changes | None = None

    def __post_init__(self) -> None:
        for name in ("seed", "starts"):
            if getattr(self, name) < 0:
                raise ValueError(f"table.{name}: {getattr(self, name)} must be 0 or more")


@dataclass(frozen=True, kw_only=True)
class Line:
    """One row of a table: a method, or why its stages do not fit together."""

    name: str
    method: Method | Control | None
    problem: str = ""


@dataclass(frozen=True, kw_only=True)
class Recipe:
    """What a table file says.

    Attributes
    ----------
    starts : how often each pair is repeated with its source under a random yaw
    paper : published figures, shown separately
    """

    title: str
    data: str = ""
    protocols: tuple[Protocol, ...]
    seed: int = 0
    starts: int = 0
    lines: tuple[Line, ...]
    paper: Printed | None = None


def known() -> list[str]:
    """Names of the tables that come with the library."""
    return sorted(f.name[:-5] for f in _shipped().iterdir() if f.name.endswith(".toml"))


def read(path: str | os.PathLike[str]) -> Recipe:
    """Read a table file, or one that comes with the library by its name.

    Raises
    ------
    FileNotFoundError
        No such file.
    KeyError, ValueError
        Not TOML, an unknown key, a value of the wrong type, an unregistered name, or two rows with one name.
    """
    # A checkout has a folder `classical`, which is also the name of a table.
    if os.fspath(path) in known() and not Path(path).is_file():
        text = _shipped().joinpath(f"{os.fspath(path)}.toml").read_text(encoding="utf-8")
        table = parse_toml(text, os.fspath(path))
    else:
        table = read_toml(path)
    try:
        return parse(table, title=Path(path).stem)
    except ValueError as error:
        raise ValueError(f"{os.fspath(path)}: {error}") from error


def parse(table: Mapping[str, Any], *, title: str = "table") -> Recipe:
    """Recipe of a table file's content."""
    keys = {each.name for each in fields(_Content)}
    unknown = set(table) - keys
    if unknown:
        raise ValueError(f"{', '.join(sorted(unknown))}: unknown; a table has {', '.join(sorted(keys))}")
    content = build(_Content, table, "table")
    lines = [*_rows(content.base, content.row), *_grid(content.base, content.sweep)]
    if not lines:
        raise ValueError("the table has no [[row]] and no [sweep]")
    _check_names([line.name for line in lines])
    return Recipe(
        title=content.title or title,
        data=content.data,
        protocols=tuple(protocol(name) for name in content.protocols),
        seed=content.seed,
        starts=content.starts,
        lines=tuple(lines),
        paper=None if content.paper is None else paper.parse(content.paper),
    )


def slug(name: str) -> str:
    """A name made safe for a file name."""
    return re.sub(r"[^a-z0-9.]+", "-", name.lower()).strip("-.") or "row"


def title_of(changed: Mapping[str, Any]) -> str:
    """Name of a row without one: what it changes."""
    parts = []
    for key, value in changed.items():
        if isinstance(value, Mapping):
            stage = [str(value["stage"])] if "stage" in value else []
            text = " ".join(stage + [f"{k}={v}" for k, v in value.items() if k != "stage"])
        else:
            text = str(value)
        parts.append(text if key == "preset" else f"{key} {text}")
    return ", ".join(parts) or "base"


def _check_names(names: Sequence[str]) -> None:
    first: dict[str, str] = {}
    for name in names:
        file = slug(name)
        if file == slug(IDENTITY):
            raise ValueError(
                f"a row is called {name!r}, as the first one of every table is; give it another name"
            )
        other = first.get(file)
        if other == name:
            raise ValueError(f"two rows are called {name!r}; give each its own name")
        if other is not None:
            raise ValueError(
                f"the rows {other!r} and {name!r} would both be stored in {file}.jsonl; give one another name, which "
                "differs in letters from a to z or in digits"
            )
        first[file] = name


def _shipped() -> Any:
    return files("hybridreg.eval").joinpath("tables")


def _rows(base: Changes, rows: Sequence[Changes]) -> Iterator[Line]:
    for row in rows:
        changed = {key: value for key, value in row.items() if key != "name"}
        own = value_of(str, row.get("name", ""), "row.name")
        name, merged = own or title_of(changed), changes.merge(base, changed)
        try:
            method = _build(merged)
        except (MissingWeights, ImportError) as error:
            yield Line(name=name, method=None, problem=str(error))
        else:
            oracle = isinstance(method, Control) and method.oracle
            yield Line(name=f"{name}{MARK}" if oracle else name, method=method)


def _grid(base: Changes, sweep: Changes) -> Iterator[Line]:
    # Every combination of the axes; one that does not fit stays in the table with the reason.
    axes = dict(_axes(sweep))
    if not axes:
        return
    for values in itertools.product(*axes.values()):
        changed: dict[str, Any] = {}
        for key, value in zip(axes, values, strict=True):
            slot, _, field = key.partition(".")
            changed = changes.merge(changed, {slot: {field: value} if field else value})
        try:
            yield Line(name=title_of(changed), method=_build(changes.merge(base, changed)))
        except (ValueError, MissingWeights, ImportError) as error:
            yield Line(name=title_of(changed), method=None, problem=str(error))


def _build(changed: Mapping[str, Any]) -> Pipeline | Control:
    keys = (*changes.KEYS, *_CONTROLS)
    unknown = sorted(set(changed) - set(keys))
    if unknown:
        raise ValueError(f"{', '.join(unknown)}: unknown; a row has name, {', '.join(keys)}")
    pipeline = changes.build({key: value for key, value in changed.items() if key not in _CONTROLS})
    oracle, image = changed.get("oracle", ""), changed.get("image", True)
    if oracle not in ("", "overlap"):
        raise ValueError(f"oracle = {oracle!r}: only 'overlap' can be taken from the ground truth")
    if image is True and not oracle:
        return pipeline
    return Control(pipeline=pipeline, oracle=bool(oracle), image=image)


def _axes(sweep: Changes, prefix: str = "") -> Iterator[tuple[str, list[Any]]]:
    for key, value in sweep.items():
        if isinstance(value, Mapping):
            yield from _axes(value, f"{prefix}{key}.")
        elif isinstance(value, list) and value:
            yield prefix + key, value
        else:
            raise ValueError(f"sweep {prefix}{key}: expected a list of values, got {value!r}")
