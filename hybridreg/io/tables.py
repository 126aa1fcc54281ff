# SPDX-License-Identifier: MIT
"""Tables of points: columns called x, y and z of pandas, polars, pyarrow, xarray or a dictionary."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.arrays import array_points, refuse_raw_las
from hybridreg.io.column_names import axes_in, find_axes
from hybridreg.io.coordinate_systems.length_unit import in_metres
from hybridreg.io.faults import fault, shorten
from hybridreg.io.list_columns import refuse_clouds_in_rows
from hybridreg.io.meaning.beside_points import changes_points, with_what_is_beside
from hybridreg.io.meaning.downward import tell_downward
from hybridreg.io.meaning.first_column import FEWEST
from hybridreg.io.meaning.image_shapes import refuse_image
from hybridreg.io.meaning.length_units import one_unit, unit_given
from hybridreg.io.meaning.named_dimensions import orders
from hybridreg.io.meaning.unit_words import column_of_units, known_metres
from hybridreg.io.record_fields import stack_axes

Array = NDArray[np.float64]

# What pandas, polars and pyarrow call the columns of a file without names.
_WIDEST = 6  # numbers a point: x, y, z and what sensors add
_UNNAMED = re.compile(r"(column_?|f|v|_)?\d+", re.IGNORECASE)


def labels(x: Any) -> list[Any] | None:
    """Names of a table's columns; None for anything that is not a table."""
    # xarray's Dataset, a mapping of its variables alone: x may be one of its coordinates.
    if hasattr(x, "data_vars"):
        variables = list(x.data_vars)
        full = {"x", "y", "z"} <= {str(each).lower() for each in variables}
        return variables if full else [*variables, *x.coords]
    if isinstance(x, Mapping):
        return list(x.keys())
    if hasattr(x, "dims") and hasattr(x, "coords"):
        along = _along(x)
        return None if along is None else [str(each) for each in x.coords[along].values]
    if hasattr(x, "column") and hasattr(x, "schema"):  # pyarrow
        return list(x.schema.names)
    if hasattr(x, "columns") and hasattr(x, "__getitem__"):
        return list(x.columns)
    return None


def points(x: Any, names: list[Any], name: str) -> Array:
    """x, y and z by their names (`hybridreg.io.column_names`); by position where no column was named; shape (N, 3).

    Missing values become NaN.

    Raises
    ------
    ValueError
        No columns, or several, that could be x, y and z; columns of unequal length, or without numbers; or as
        `refuse_raw_las`.
    """
    told = [str(each[-1]) if isinstance(each, tuple) else str(each) for each in names]
    unnamed = len(names) >= 3 and all(_UNNAMED.fullmatch(each) for each in told)
    if unnamed:
        _refuse_lying(x, names, name)
        refuse_image(len(_numbers(x, 0, names, name)), len(names), name)
    if unnamed and find_axes(told, name) is None:
        # Positions again: the first may be none.
        columns = [_numbers(x, k, names, name) for k in range(min(6, len(names)))]
        return array_points(np.column_stack(columns), name, cure="call the columns of x, y and z so")
    axes = axes_in(told, name)
    turned = orders([_column(x, k, names) for k in axes.columns], x, name)
    columns = [_numbers(x, k, names, name, order) for k, order in zip(axes.columns, turned, strict=True)]
    if len({len(column) for column in columns}) > 1:
        lengths = ", ".join(str(len(column)) for column in columns)
        raise fault(name, f"x, y and z have the lengths {lengths}", "give them equally long")
    if all(np.array_equal(column, np.round(column)) for column in columns):
        refuse_raw_las(told, name)
    upright = _column(x, axes.columns[2], names)
    tell_downward(
        _attributes(upright).get("positive", getattr(upright, "positive", None)), name
    )  # or netCDF4's
    metres = axes.metres if axes.metres is not None else _unit(x, axes.columns, names, name)
    points = with_what_is_beside(stack_axes(*columns), beside(x, names, axes.columns), name)
    return in_metres(points, metres, name)


def _refuse_lying(x: Any, names: list[Any], name: str) -> None:
    # Without names of columns and wide as no points are; pandas' rows may have names.
    if len(names) < FEWEST or isinstance(x, Mapping):
        return
    rows = len(_numbers(x, 0, names, name))
    if 3 <= rows <= _WIDEST:
        named = {"x", "y", "z"} <= {str(each).lower() for each in getattr(x, "index", ())}
        cure = (
            "give x.T" if named else "give x.to_numpy()" if hasattr(x, "to_numpy") else "transpose it first"
        )
        problem = f"its {rows} rows of {len(names)} numbers are no points, of which each has a row"
        raise fault(name, problem, f"if the rows are x, y and z, {cure}")


def beside(x: Any, names: list[Any], columns: Iterable[int] = ()) -> dict[str, Any]:
    """What may change the points of a table: other entries, its attributes, and those of its three `columns`."""
    found = {str(each): _column(x, k, names) for k, each in enumerate(names) if changes_points(each)}
    found.update(attributes_beside(x))
    each_has = [attributes_beside(_column(x, k, names)) for k in columns]
    for key in set(each_has[0]).intersection(*each_has[1:]) if each_has else ():
        found[key] = [np.ravel(each[key])[0] for each in each_has]
    return found


def attributes_beside(x: Any) -> dict[str, Any]:
    """Those attributes of an object that may change its points."""
    return {str(key): value for key, value in _attributes(x).items() if changes_points(key)}


def _attributes(x: Any) -> Mapping[Any, Any]:
    # As NetCDF and HDF5 keep them: xarray's and h5py's; pandas has them too.
    attributes = getattr(x, "attrs", None)
    # netCDF4's variables, which multiply by their scale themselves unless they were told not to.
    if callable(getattr(x, "ncattrs", None)) and not getattr(x, "scale", True):
        return {each: x.getncattr(each) for each in x.ncattrs()}
    return attributes if isinstance(attributes, Mapping) else {}


def _unit(x: Any, columns: tuple[int, int, int], names: list[Any], name: str) -> float | None:
    """Metres of the unit that the columns say, or the table for all of them."""
    if hasattr(x, "column") and hasattr(x, "schema"):
        said = one_unit((unit_given(x.schema.field(k), name) for k in columns), name)
        return unit_given(x.schema, name) if said is None else said
    said = one_unit((unit_given(_column(x, k, names), name) for k in columns), name)
    said = unit_given(x, name) if said is None else said
    column = column_of_units([str(each) for each in names])
    if said is not None or column is None or isinstance(x, Mapping):
        return said
    words = {str(word) for word in _objects(_column(x, column, names)).tolist()}
    return one_unit(map(known_metres, words), name)


def _along(x: Any) -> Any:
    # The dimension of xarray's DataArray whose labels are the axes.
    for each in x.dims:
        if each in x.coords and {"x", "y", "z"} <= {
            str(label).lower() for label in x.coords[each].values[:50]
        }:
            return each
    return None


def _column(x: Any, k: int, names: list[Any]) -> Any:
    if hasattr(x, "colnames"):  # astropy, whose iloc is another
        return x[names[k]]
    if hasattr(x, "iloc"):  # pandas, where two columns may have one name
        return x.iloc[:, k]
    if hasattr(x, "column") and hasattr(x, "schema"):
        return x.column(k)
    if not isinstance(x, Mapping) and not hasattr(x, "data_vars") and hasattr(x, "dims"):
        return x.isel({_along(x): k}).values
    return x[names[k]]


def _numbers(x: Any, k: int, names: list[Any], name: str, order: tuple[int, ...] | None = None) -> Array:
    """Column `k` as float64, (N,), of its cells with their dimensions in another order if one is given."""
    values = _column(x, k, names)
    values = values.magnitude if hasattr(values, "magnitude") and hasattr(values, "units") else values  # pint
    if hasattr(values, "detach"):
        values = values.detach().cpu()
    try:
        return np.ravel(np.transpose(_floats(values), order) if order else _floats(values))
    except (TypeError, ValueError) as error:
        refuse_clouds_in_rows(next(iter(_objects(values)), None), names[k], name)
        problem = f"column {shorten(names[k])} holds something else than numbers ({shorten(error)})"
        raise fault(name, problem, "convert it to float") from error


def _objects(values: Any) -> NDArray[Any]:
    return np.ravel(values.to_numpy() if hasattr(values, "to_numpy") else np.asarray(values, object))


def _floats(values: Any) -> NDArray[Any]:
    if hasattr(values, "to_numpy"):
        try:
            return np.asarray(
                values.to_numpy(dtype=np.float64, na_value=np.nan)
            )  # pandas' nullable types too
        except TypeError:
            values = values.to_numpy()  # polars, pyarrow: a null makes floats of it, with NaN
    array = values if np.ma.isMaskedArray(values) else np.asarray(values)
    return np.ma.filled(array.astype(np.float64), np.nan)
