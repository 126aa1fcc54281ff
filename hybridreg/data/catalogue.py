# SPDX-License-Identifier: MIT
"""Data sets by name, imported on demand."""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from operator import attrgetter
from pathlib import Path

from hybridreg.pair import LabelledPair
from hybridreg.runtime import plugins

ENTRY_POINTS = "hybridreg.datasets"

# A loader takes the text after the colon and gives a sequence of labelled pairs.
BUILT_IN = {
    "3dcsr": "hybridreg.data.loaders.threedcsr:ThreeDCsr.from_text",
    "3dmatch": "hybridreg.data.loaders.threedmatch:ThreeDMatch.from_text",
    "cross-lidar": "hybridreg.data.loaders.cross_lidar:CrossLidar.from_text",
    "cross3dreg": "hybridreg.data.loaders.cross3dreg:Cross3DReg.from_text",
    "dair-v2x": "hybridreg.data.loaders.dair_v2x:DairV2x.from_text",
    "folder": "hybridreg.data.loaders.folder:PairFolder.from_text",
    "helipr": "hybridreg.data.loaders.helipr:HeLiPr.from_text",
    "kitti": "hybridreg.data.loaders.kitti:Kitti.from_text",
    "pandaset": "hybridreg.data.loaders.pandaset:PandaSet.from_text",
    "sim": "hybridreg.data.loaders.simulated:Simulated",
    "tiers": "hybridreg.data.loaders.tiers:Tiers.from_text",
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
    text : path of a folder, or "name:rest"
        A folder is a folder of pairs or one of the layouts that `hybridreg.data.layouts` knows. `rest` is
        what the loader of that name takes: a path for most, with options after a hash ("kitti:PATH#val").

    Raises
    ------
    FileNotFoundError
        Neither a folder nor a loader's name; or the loader misses its files and says where they must lie.
    ImportError
        A plug-in that cannot be loaded, whatever its import raises.
    """
    whole = os.fspath(text)
    name, colon, rest = whole.partition(":")
    if colon and name in known() and not Path(whole).exists():
        return _open(name, rest)
    path = whole if Path(whole).exists() else whole.partition("#")[0]
    if not Path(path).is_dir():
        raise FileNotFoundError(
            f"{whole}: there is no such folder, and no loader of that name; "
            f"give a folder of pairs or one of {', '.join(f'{n}:...' for n in names())}"
        )
    from hybridreg.data.layouts import layout_of

    return _open(layout_of(Path(path)) or "folder", whole)


def _open(name: str, rest: str) -> Sequence[LabelledPair]:
    if name not in BUILT_IN:
        loaded: Sequence[LabelledPair] = plugins.load(known()[name], f"loader {name!r}", ENTRY_POINTS)(rest)
        return loaded
    module, _, attribute = known()[name].partition(":")
    pairs: Sequence[LabelledPair] = attrgetter(attribute)(import_module(module))(rest)
    return pairs
