# SPDX-License-Identifier: MIT
"""Published figures, on their authors' data: a separate table, never columns of ours."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from hybridreg.config.plain_values import build
from hybridreg.eval.report.table_columns import Cells

_KEYS = {"source", "data", "columns", "rows"}


@dataclass(frozen=True, kw_only=True)
class Printed:
    """A table from a paper.

    Attributes
    ----------
    source : where it is printed
    data : what it was measured on
    columns : headings
    rows : figures by line
    """

    source: str
    data: str
    columns: tuple[str, ...]
    rows: Mapping[str, tuple[float, ...]]

    def heading(self) -> str:
        """What the table is, so that nobody mistakes it for ours."""
        return f"As printed in {self.source}, measured on {self.data}: not comparable with the tables above"

    def cells(self) -> list[Cells]:
        """Its lines."""
        return [
            {"method": name, **{key: f"{value:g}" for key, value in zip(self.columns, values, strict=True)}}
            for name, values in self.rows.items()
        ]

    def to_dict(self) -> dict[str, Any]:
        """Plain values that `parse` takes back."""
        return asdict(self)


def parse(table: Mapping[str, Any]) -> Printed:
    """The `[paper]` of a table file.

    Raises
    ------
    ValueError
        A key is missing or unknown, or a row has not one number a column.
    """
    if set(table) != _KEYS:
        raise ValueError(f"paper: has the keys {', '.join(sorted(_KEYS))}; got {', '.join(sorted(table))}")
    printed = build(Printed, table, "paper")
    for name, values in printed.rows.items():
        if len(values) != len(printed.columns):
            raise ValueError(
                f"paper: row {name!r} has {len(values)} numbers for {len(printed.columns)} columns"
            )
    return printed
