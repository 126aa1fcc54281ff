# SPDX-License-Identifier: MIT
"""3DMatch and 3DLoMatch: indoor fragments, in the archives of GeoTransformer and of Predator."""

from __future__ import annotations

import os
from pathlib import Path, PurePosixPath

from hybridreg.data.lists import pair_records, required_files
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.pair_files import PairFiles


class ThreeDMatch(ListedPairs):
    """Pairs of fragments fused from depth images.

    Parameters
    ----------
    root : path
        Holds `metadata/<part>.pkl` and `data/{train,test}/<scene>/cloud_bin_<n>.pth` (GeoTransformer), or
        `<part>_info.pkl` and `{train,test}/<scene>/cloud_bin_<n>.pth` (Predator).
    part : str
        "3DMatch" (overlap above 0.3), "3DLoMatch" (0.1 to 0.3), "train" or "val".

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must be.
    ValueError
        The list is empty, damaged, or refers to classes that a list of pairs does not need.
    """

    def __init__(self, root: str | os.PathLike[str], part: str = "3DMatch") -> None:
        base = required_files.folder(Path(root), "3DMatch")
        names = (f"metadata/{part}.pkl", f"{part}_info.pkl", f"metadata/{part}_info.pkl", f"{part}.pkl")
        table = required_files.first([base / name for name in names], f"the list of the pairs of {part}")
        rows = pair_records.read_records(table)
        shelf = required_files.Shelf()
        entries = [_entry(row, base, f"{table}, pair {n}", shelf) for n, row in enumerate(rows)]
        super().__init__(entries, table, overlap_radius=0.1, fields=tuple(map(str, rows[0])))


def _entry(row: pair_records.Record, base: Path, label: str, shelf: required_files.Shelf) -> PairFiles:
    source, target = (
        PurePosixPath(str(pair_records.need(row, names, label)))
        for names in (pair_records.SOURCE, pair_records.TARGET)
    )
    return PairFiles(
        id=f"{source.parent.name}/{_number(source)}-{_number(target)}",
        source=_place(base, source, shelf),
        target=_place(base, target, shelf),
        T_target_source=pair_records.transform_of(row, label),
        overlap=pair_records.overlap(row, label),
    )


def _place(base: Path, relative: PurePosixPath, shelf: required_files.Shelf) -> Path:
    candidates = [base / "data" / relative, base / relative]
    return next((place for place in candidates if shelf.has(place)), candidates[0])


def _number(path: PurePosixPath) -> str:
    return path.stem.rpartition("_")[2]
