# SPDX-License-Identifier: MIT
"""Data sets by name, imported when they are asked for."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path

from hybridreg.pair import LabelledPair

ENTRY_POINTS = "hybridreg.datasets"

# A loader takes the text after the colon and gives a sequence of labelled pairs.
BUILT_IN = {
    "folder": "hybridreg.data.folder:PairFolder",
    "sim": "hybridreg.data.simulated:Simulated",
}


@cache
def known() -> dict[str, str]:
    """Every loader that can be named, as its name to `module:callable`; plug-ins included."""
    plugged = {point.name: point.value for point in entry_points(group=ENTRY_POINTS)}
    return {**plugged, **BUILT_IN}


def names() -> list[str]:
    """Names that may stand before the colon in `open_dataset`."""
    return sorted(known())


def open_dataset(text: str | os.PathLike[str]) -> Sequence[LabelledPair]:
    """Open a data set.

    Parameters
    ----------
    text : path of a folder of pairs, or "name:rest"
        `rest` is what the loader of that name takes: a path for most, "test/near" for a simulator.

    Raises
    ------
    FileNotFoundError
        Neither a folder nor a loader's name; or the loader misses its files and says where they must lie.
    """
    name, colon, rest = os.fspath(text).partition(":")
    if colon and name in known() and not Path(text).exists():
        module, _, attribute = known()[name].partition(":")
        pairs: Sequence[LabelledPair] = getattr(import_module(module), attribute)(rest)
        return pairs
    if not Path(text).is_dir():
        raise FileNotFoundError(
            f"{os.fspath(text)}: there is no such folder, and no loader of that name; "
            f"give a folder of pairs or one of {', '.join(f'{n}:...' for n in names())}"
        )
    from hybridreg.data.folder import PairFolder

    return PairFolder(text)
