# SPDX-License-Identifier: MIT
"""Predictions on disk: one line with the configuration, then one line a pair, appended as it finishes."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Collection, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hybridreg.config.changed_settings import differences
from hybridreg.eval.run.header import FORMAT, header_of, refuse_foreign, whole_lines
from hybridreg.eval.run.row import Row
from hybridreg.io.atomic import write_text
from hybridreg.io.faults import naming
from hybridreg.io.line_file import LineFile, cut
from hybridreg.io.lock import file_lock

_CURE = "pass overwrite=True to start over, or write to another path"


@dataclass(frozen=True, eq=False)
class Predictions:
    """A file of predictions, read.

    Attributes
    ----------
    config : how the rows were made: the method's spec, the data, the seed
    rows : in the order of the data set
    """

    config: dict[str, Any]
    rows: list[Row]


def read(path: str | os.PathLike[str]) -> Predictions:
    """Read a file of predictions; a last line that was truncated by a crash is left out.

    Raises
    ------
    FileNotFoundError
        No such file.
    ValueError
        The content is something else, or a line before the last is broken.
    """
    if not Path(path).is_file():
        raise FileNotFoundError(
            f"{os.fspath(path)}: no file of predictions; run `hybridreg eval` to make one"
        )
    lines, _ = whole_lines(Path(path))
    if not lines:
        raise ValueError(f"{os.fspath(path)}: holds no predictions; run `hybridreg eval` to make some")
    config: dict[str, Any] = header_of(lines[0], path)["config"]
    rows: dict[str, Row] = {}
    for number, line in enumerate(lines[1:], start=2):
        try:
            row = Row.from_json(line)
        except ValueError as error:
            raise ValueError(f"{os.fspath(path)}, line {number}: {error}") from error
        rows[row.id] = row
    return Predictions(config, sorted(rows.values(), key=lambda row: row.index))


class Appender:
    """Opens a file of predictions to add rows.

    The file is locked until the block ends. If it is deleted in the meantime it is written again, whole.

    Parameters
    ----------
    ids : names of all pairs; with them a file that has all rows is neither locked nor touched
    seen : what the data's files looked like (`hybridreg.data.dataset.looks_of`), stored with the configuration

    Raises
    ------
    InUse
        Another process is writing it.
    ValueError
        The file was made by another configuration, or is damaged; the message says what differs.
    OSError
        It cannot be written; the message names it.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        config: Mapping[str, Any],
        *,
        ids: Collection[str] | None = None,
        overwrite: bool = False,
        seen: str = "",
    ) -> None:
        self.path, self._config = Path(path), config
        self._header = json.dumps({"format": FORMAT, "config": config, **({"seen": seen} if seen else {})})
        self._lock, self._held = file_lock(self.path), ExitStack()
        self._file: LineFile | None = None
        self.done = [] if overwrite else self._kept()
        if ids is not None and not overwrite and {row.id for row in self.done}.issuperset(ids):
            self._lock.sweep()
            return
        with naming(self.path):
            self.path.parent.mkdir(parents=True, exist_ok=True)
        with ExitStack() as stack:
            stack.enter_context(self._lock)
            # Read again: until now another process could have written.
            self.done = [] if overwrite else self._kept()
            self._file = self._opened(anew=overwrite)
            self._held = stack.pop_all()

    def add(self, row: Row) -> None:
        """Append a row."""
        self._present().add(row.to_json())
        self.done.append(row)

    def __enter__(self) -> Appender:
        return self

    def __exit__(self, *_: object) -> None:
        with self._held:
            if self._file is not None:
                try:
                    self._present()
                finally:
                    self._file.close()

    def _kept(self) -> list[Row]:
        # Rows of an earlier run under the same configuration.
        if not self.path.exists():
            return []
        lines, _ = whole_lines(self.path)
        if not lines:
            refuse_foreign(self.path)
            return []
        before, now = header_of(lines[0], self.path)["config"], json.loads(json.dumps(self._config))
        changed = list(differences(_by_content(before), _by_content(now)))
        if changed:
            raise ValueError(f"{self.path} was made by another configuration ({'; '.join(changed)}); {_CURE}")
        try:
            return read(self.path).rows
        except ValueError as error:
            raise ValueError(f"{error}; {_CURE}") from error

    def _opened(self, *, anew: bool) -> LineFile:
        whole = whole_lines(self.path)[1] if self.path.exists() and not anew else 0
        if whole:
            # What follows the last complete line is a partial row of an interrupted run.
            cut(self.path, whole)
            return LineFile(self.path, anew=False)
        file = LineFile(self.path, anew=True)
        file.add(self._header)
        return file

    def _present(self) -> LineFile:
        # The open file, recreated where it was deleted.
        assert self._file is not None
        if not self._file.is_there():
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._lock.renew()
            write_text(
                self.path, "".join(f"{line}\n" for line in (self._header, *map(Row.to_json, self.done)))
            )
            self._file.close()
            self._file = LineFile(self.path, anew=False)
            told = f"{self.path} was deleted while it was being written; made again with its {len(self.done)} rows"
            warnings.warn(told, UserWarning, stacklevel=4)
        return self._file


def _by_content(config: Mapping[str, Any]) -> dict[str, Any]:
    # Data are the same wherever they lie, and however their path is written.
    data = config.get("data")
    if not isinstance(data, Mapping) or not data.get("fingerprint"):
        return dict(config)
    return {**config, "data": {key: value for key, value in data.items() if key != "name"}}
