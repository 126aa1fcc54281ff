# SPDX-License-Identifier: MIT
"""Columns whose dimensions have names, such as those of xarray and netCDF4: whether their cells belong together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from hybridreg.io.faults import fault, shorten
from hybridreg.io.meaning.grids import rows_of


def orders(columns: Sequence[Any], table: Any, name: str) -> list[tuple[int, ...] | None]:
    """How to transpose each column, so that all have the dimensions of the first in its order; None where it has no
    names of dimensions, or stands right.

    Cell after cell, x over (ring, azimuth) and z over (azimuth, ring) would be paired at random, and three axes of a
    grid that happen to be equally long would be points on its diagonal.

    Raises
    ------
    ValueError
        The dimensions are not the same.
    """
    named = [_dimensions(each) for each in columns]
    first = named[0]
    if first is None or None in named:
        return [None] * len(columns)
    told = [each for each in named if each is not None]
    if any(sorted(each) != sorted(first) for each in told):
        shown = "; ".join(f"({', '.join(each)})" for each in told)
        problem = f"its x, y and z lie along different dimensions: {shorten(shown, 200)}"
        raise fault(name, problem, f"give a row for each point: {_as_rows(columns[0], table)}")
    return [None if each == first else tuple(each.index(axis) for axis in first) for each in told]


def _as_rows(column: Any, table: Any) -> str:
    if hasattr(table, "data_vars"):
        return rows_of(table, "")
    if hasattr(column, "to_dataframe"):  # of one array with its coordinates
        return rows_of(table if hasattr(table, "to_dataframe") else column, "value")
    return "xarray.open_dataset(path).to_dataframe().reset_index()"


def _dimensions(column: Any) -> tuple[str, ...] | None:
    found = getattr(column, "dims", getattr(column, "dimensions", None))  # of xarray; of netCDF4
    if not isinstance(found, tuple) or not all(isinstance(each, str) for each in found):
        return None  # h5py's, which mostly have none
    return found if len(set(found)) == len(found) else None
