# SPDX-License-Identifier: MIT
"""Feather and Parquet tables with columns x, y and z (Argoverse 2, nuScenes exports), through `pyarrow`."""

from __future__ import annotations

from pathlib import Path

from hybridreg.io.faults import foreign_parser
from hybridreg.io.point_objects import points_of
from hybridreg.io.recorded.recording import Recorded, Selection
from hybridreg.runtime.optional_packages import load


def read_arrow(path: Path, selection: Selection) -> Recorded:
    """Read x, y and z of a `.feather`, `.arrow` or `.parquet` file; a missing value is not finite.

    Argoverse stores half floats: 3 cm apart at 64 m and beyond, and in the vehicle's frame.

    Raises
    ------
    ValueError
        Damaged, or without such columns.
    ImportError
        Without pyarrow.
    """
    name = str(path)
    parquet = path.suffix.lower() == ".parquet"
    module = load("pyarrow.parquet" if parquet else "pyarrow.feather", f"{name}: a table of Arrow's")
    with foreign_parser(name, "a table of Arrow's"):
        table = module.read_table(name)
    return Recorded(points_of(table, name))
