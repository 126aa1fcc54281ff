# SPDX-License-Identifier: MIT
"""Predictions on disk: a line that tells the configuration, then one line a pair, appended as it is done."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hybridreg.eval.row import Row
from hybridreg.io.structured import parse_json
from hybridreg.plain_values import value_of

_FORMAT = "hybridreg predictions 1"


@dataclass(frozen=True, eq=False)
class Predictions:
    """A file of predictions, read.

    Attributes
    ----------
    config : what made the rows: the method's spec, the data, the seed
    rows : in the order of the data set
    """

    config: dict[str, Any]
    rows: list[Row]


def read(path: str | os.PathLike[str]) -> Predictions:
    """Read a file of predictions; a last line that was cut off by a crash is left out.

    Raises
    ------
    FileNotFoundError
        No such file.
    ValueError
        No such file's content, or a broken line before the last.
    """
    if not Path(path).is_file():
        raise FileNotFoundError(
            f"{os.fspath(path)}: no file of predictions; run `hybridreg eval` to make one"
        )
    lines, _ = _whole_lines(Path(path))
    if not lines:
        raise ValueError(f"{os.fspath(path)}: holds no predictions; run `hybridreg eval` to make some")
    config = _header(lines[0], path)
    rows: dict[str, Row] = {}
    for number, line in enumerate(lines[1:], start=2):
        try:
            row = Row.from_json(line)
        except ValueError as error:
            raise ValueError(f"{os.fspath(path)}, line {number}: {error}") from error
        rows[row.id] = row
    return Predictions(config, sorted(rows.values(), key=lambda row: row.index))


class Appender:
    """Opens a file of predictions to add rows, each on the disk before the next is computed.

    Raises
    ------
    ValueError
        The file was made by another configuration; the message tells what differs.
    """

    def __init__(
        self, path: str | os.PathLike[str], config: Mapping[str, Any], *, overwrite: bool = False
    ) -> None:
        self.path = Path(path)
        self.path.parent.mkdir(parents=True, exist_ok=True)
        if overwrite or not self._resumable(config):
            self.done: list[Row] = []
            self._file = self.path.open("w", encoding="utf-8")
            self._write(json.dumps({"format": _FORMAT, "config": config}))
        else:
            self.done = read(self.path).rows
            self._file = self.path.open("a", encoding="utf-8")

    def add(self, row: Row) -> None:
        """Append a row."""
        self._write(row.to_json())

    def __enter__(self) -> Appender:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def _write(self, line: str) -> None:
        self._file.write(line + "\n")
        self._file.flush()
        os.fsync(self._file.fileno())

    def _resumable(self, config: Mapping[str, Any]) -> bool:
        if not self.path.exists():
            return False
        lines, n_bytes = _whole_lines(self.path)
        if not lines:
            _refuse_foreign(self.path)
            return False
        changed = list(differences(_header(lines[0], self.path), json.loads(json.dumps(config))))
        if changed:
            raise ValueError(
                f"{self.path} was made by another configuration ({'; '.join(changed)}); "
                "add --overwrite to make it anew, or choose another --out"
            )
        # What follows the last whole line is half a row of a run that was cut off.
        os.truncate(self.path, n_bytes)
        return True


def differences(old: Any, new: Any, name: str = "") -> Iterator[str]:
    """What changed between two configurations, one phrase a leaf."""
    if isinstance(old, Mapping) and isinstance(new, Mapping):
        for key in sorted({*old, *new}):
            yield from differences(old.get(key), new.get(key), f"{name}.{key}" if name else key)
    elif old != new:
        yield f"{name}: {_short(old)} before, {_short(new)} now"


def _short(value: Any) -> str:
    return "unset" if value is None else json.dumps(value)


def _whole_lines(path: Path) -> tuple[list[str], int]:
    data = path.read_bytes()
    end = data.rfind(b"\n") + 1
    try:
        return data[:end].decode("utf-8").splitlines(), end
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: not a file of predictions ({error})") from error


def _refuse_foreign(path: Path) -> None:
    # A file without one whole line may be replaced only if it is the beginning of a header.
    begun = path.read_bytes()
    if not json.dumps({"format": _FORMAT}).encode().startswith(begun[:20]):
        raise ValueError(f"{path}: not a file of predictions; choose another --out")


def _header(line: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    try:
        header = parse_json(line, os.fspath(path))
    except ValueError:
        header = None
    if not isinstance(header, dict) or header.get("format") != _FORMAT:
        raise ValueError(f"{os.fspath(path)}: not a file of predictions; its first line is not {_FORMAT!r}")
    config: dict[str, Any] = value_of(
        Mapping[str, Any], header.get("config"), f"{os.fspath(path)}, line 1: config"
    )
    return config
