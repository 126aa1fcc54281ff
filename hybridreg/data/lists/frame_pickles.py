# SPDX-License-Identifier: MIT
"""Pickled pandas tables as columns of numbers, without pandas and without running what a pickle carries."""

from __future__ import annotations

import io
import zlib
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.lists.pickles import Forbidden, PlainUnpickler
from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.whole_files import read_whole

Columns = dict[str, NDArray[Any]]

# Bytes that a packed frame may unpack to; one of PandaSet's takes 10 million.
_LARGEST = 1 << 29
_CURE = "take the file from where the data set's authors publish it; nothing of it was run"


def read_columns(path: Path) -> Columns:
    """Columns (n,) by name of a pickled DataFrame, packed by gzip where the name ends so.

    Three layouts of pandas are known: that of its versions below 1.3, the later one, and 3's, with labels by pyarrow.

    Raises
    ------
    FileNotFoundError
        Nothing lies at `path`.
    ValueError
        Damaged, no DataFrame of numbers, or a pickle that asks for any class or function but those of a DataFrame, none
        of which is imported.
    """
    data, name = read_whole(path), str(path)
    if path.suffix == ".gz":
        data = _unpacked(data, name)
    refused = ""
    with foreign_parser(name, "a pickled table"):
        try:
            found = _FrameUnpickler(io.BytesIO(data)).load()
        except Forbidden as error:
            found, refused = None, error.name
    if refused:
        raise fault(name, f"asks for {refused}, which a table of numbers has no use for", _CURE)
    state = found.held if isinstance(found, _Frame) else None
    manager = state.get("_mgr", state.get("_data")) if isinstance(state, dict) else None
    if not isinstance(manager, _Manager):
        raise fault(name, "holds no pandas DataFrame", _CURE)
    with foreign_parser(name, "a pickled table"):
        return _columns(manager)


def _unpacked(data: bytes, name: str) -> bytes:
    reader = zlib.decompressobj(wbits=31)
    with foreign_parser(name, "a gzip file"):
        content = reader.decompress(data, _LARGEST)
        whole = reader.eof
    if not whole:
        told = f"unpacks to more than {_LARGEST} bytes" if reader.unconsumed_tail else "ends in the middle"
        raise fault(name, told)
    return content


class _Frame:
    """In a DataFrame's place: keeps what the pickle sets."""

    held: Any = None

    def __setstate__(self, state: Any) -> None:
        self.held = state


class _Manager(_Frame):
    """In the place of the blocks behind a DataFrame."""

    parts: tuple[Any, ...] = ()

    def __init__(self, *parts: Any) -> None:
        self.parts = parts


class _Labels(list[Any]):
    """In an index's place: its labels."""

    def __setstate__(self, state: Any) -> None:
        """Names and caches say nothing of the labels."""


def _new_labels(_: Any, told: Any) -> _Labels:
    if "data" not in told:
        return _Labels()  # a range of rows, which is not looked at
    data = told["data"]
    return _Labels(data.held["_pa_array"] if isinstance(data, _Frame) else np.asarray(data).tolist())


def _strings(told: Any) -> list[str]:
    # pyarrow's: type, length, nulls, first row, and the buffers: which are there, where each ends, the letters.
    kind, n, _, first, (_, ends, letters) = told[:5]
    wide = {"string": "<i4", "large_string": "<i8"}[kind]
    at = np.frombuffer(ends, dtype=wide)[first : first + n + 1]
    return [bytes(letters[a:b]).decode("utf-8") for a, b in pairwise(at)]


def _same(value: Any, *_: Any) -> Any:
    return value


def _block(values: Any, places: Any, *_: Any) -> tuple[Any, Any]:
    return values, places


_CLASSES: dict[str, type] = {
    "pandas.core.frame.DataFrame": _Frame,
    "pandas.DataFrame": _Frame,
    "pandas.arrays.ArrowStringArray": _Frame,
    "pandas.Index": _Labels,
    "pandas.RangeIndex": _Labels,
    "pandas.core.internals.managers.BlockManager": _Manager,
    "pandas.core.indexes.base.Index": _Labels,
    "pandas.core.indexes.range.RangeIndex": _Labels,
    "pandas.core.indexes.numeric.Int64Index": _Labels,
}
_FUNCTIONS: dict[str, Any] = {
    "pandas.core.indexes.base._new_Index": _new_labels,
    "pandas._libs.internals._unpickle_block": _block,
    "pandas.StringDtype": _same,
    "pyarrow.lib._restore_array": _strings,
    "pyarrow.lib.type_for_alias": _same,
    "pyarrow.lib.py_buffer": _same,
    "builtins.bytearray": _same,
    "builtins.slice": slice,
    "__builtin__.slice": slice,
}


class _FrameUnpickler(PlainUnpickler):
    def find_class(self, module: str, name: str) -> Any:
        full = f"{module}.{name}"
        if full in _CLASSES:
            # A fresh class, as a pickle may set attributes of what it was given.
            return type(name, (_CLASSES[full],), {})
        if full in _FUNCTIONS:
            return lambda *given: _FUNCTIONS[full](*given)
        return super().find_class(module, name)


def _columns(manager: _Manager) -> Columns:
    if manager.parts:
        blocks, axes = manager.parts[:2]
    else:
        known = manager.held[3]["0.14.1"]
        axes, blocks = known["axes"], [(block["values"], block["mgr_locs"]) for block in known["blocks"]]
    labels, columns = [str(label) for label in axes[0]], {}
    for values, places in blocks:
        rows = np.atleast_2d(np.asarray(values))
        for row, label in zip(rows, np.array(labels, dtype=object)[_rows(places)], strict=True):
            columns[str(label)] = row
    return columns


def _rows(places: Any) -> Any:
    return places if isinstance(places, slice) else np.atleast_1d(np.asarray(places, dtype=np.int64))
