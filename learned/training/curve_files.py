# SPDX-License-Identifier: MIT
"""Learning curves as CSV files: lines are written whole or not at all, and a resumed run removes those that it
repeats."""

from __future__ import annotations

import csv
import errno
import io
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from hybridreg.io.atomic import write_text
from hybridreg.io.csv_cells import cell
from hybridreg.io.faults import naming

Value = str | int | float


class CurveFile:
    """A CSV file with the columns ``total`` and those given, one line at a time."""

    def __init__(self, path: Path, columns: Sequence[str]) -> None:
        self.path, self.columns = path, ("total", *columns)

    def begin(self, total: int) -> None:
        """Keep the lines of an earlier run up to step ``total``, drop those that this run will write again."""
        kept = [row for row in self.rows() if int(row["total"]) <= total] if total else []
        write_text(self.path, self._text(dict(zip(self.columns, self.columns, strict=True))))
        for row in kept:
            self.append(row)

    def append(self, row: Mapping[str, Value]) -> None:
        """Add a line, whole or not at all; columns that are not given stay empty.

        Raises
        ------
        OSError
            A full disk; it names the file.
        """
        line = self._text(row).encode()
        with naming(self.path):
            handle = os.open(self.path, os.O_WRONLY | os.O_APPEND)
            try:
                before = os.fstat(handle).st_size
                if os.write(handle, line) < len(line):
                    os.ftruncate(handle, before)
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            finally:
                os.close(handle)

    def rows(self) -> list[dict[str, str]]:
        """All lines; none where there is no file."""
        if not self.path.is_file():
            return []
        lines = self.path.read_text(encoding="utf-8").splitlines(keepends=True)
        # A process that was killed may have left a partial line.
        return list(csv.DictReader(line for line in lines if line.endswith("\n")))

    def _text(self, row: Mapping[str, Value]) -> str:
        text = io.StringIO()
        csv.DictWriter(text, self.columns, lineterminator="\n", extrasaction="ignore").writerow(
            {name: _short(row.get(name, "")) for name in self.columns}
        )
        return text.getvalue()


def _short(value: Value) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(cell(value))
