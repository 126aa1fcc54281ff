# SPDX-License-Identifier: MIT
"""KITTI odometry as the usual benchmark of LiDAR registration: pairs about 10 m apart."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.lists import kitti_list, pair_records, required_files
from hybridreg.data.lists.kitti_drives import SPLITS, Drive, base_of
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.pair_files import PairFiles
from hybridreg.data.lists.trajectories import rigid
from hybridreg.io.faults import foreign_parser

Array = NDArray[np.float64]

_SENSOR = "Velodyne HDL-64E"
# Pairs, and what their list calls its columns.
_Made = tuple[list[PairFiles], tuple[str, ...]]


class Kitti(ListedPairs):
    """Pairs of scans of one sequence; the usual thresholds are 5 deg and 2 m.

    `poses` and every pair's `meta["poses"]` say which poses are used, because they differ: FCGF,
    Predator and CoFiNet multiplied the ICP correction on the wrong side (FCGF issue 65).

    Parameters
    ----------
    root : path
        Holds KITTI odometry's `sequences/NN/velodyne/NNNNNN.bin`, and one of the lists below; or a folder
        `dataset` with them.
    split : str
        "train" (00 to 05), "val" (06, 07) or "test" (08 to 10).
    poses : str
        "published": `metadata/<split>.pkl` of GeoTransformer, as it is. "own": what `hybridreg datasets
        kitti-list` writes to `metadata/hybridreg-<split>.json`, composed `T_icp @ M`. "icp": Predator's
        `icp/S_i_j.npy`, composed `M @ T_icp`. "odometry": `poses/NN.txt` without ICP. Empty: the first that exists.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must be.
    ValueError
        The list is empty, damaged, or refers to classes that a list of pairs does not need.
    """

    def __init__(self, root: str | os.PathLike[str], split: str = "test", poses: str = "") -> None:
        base = base_of(Path(root))
        if split not in SPLITS or poses not in ("", *_MAKERS):
            raise ValueError(
                f"split={split!r} must be one of {', '.join(SPLITS)}, poses={poses!r} of {', '.join(_MAKERS)}"
            )
        self.poses = poses or _first_there(base, split)
        entries, fields = _MAKERS[self.poses](base, split)
        super().__init__(entries, base, fields=fields)


def _first_there(base: Path, split: str) -> str:
    marks = {
        "published": base / f"metadata/{split}.pkl",
        "own": kitti_list.place(base, split),
        "icp": base / "icp",
        "odometry": base / "poses",
    }
    there = [name for name, mark in marks.items() if mark.exists()]
    if not there:
        raise FileNotFoundError(
            f"a list of KITTI's pairs is missing; GeoTransformer's must lie at {marks['published']}, "
            f"Predator's icp/ or KITTI's own poses/ in {base}"
        )
    return there[0]


def _published(base: Path, split: str) -> _Made:
    table = required_files.first([base / f"metadata/{split}.pkl"], "GeoTransformer's list of KITTI's pairs")
    shelf = required_files.Shelf()
    rows = pair_records.read_records(table)
    entries = [_published_entry(row, base, f"{table}, pair {n}", shelf) for n, row in enumerate(rows)]
    return entries, tuple(map(str, rows[0]))


def _published_entry(
    row: pair_records.Record, base: Path, label: str, shelf: required_files.Shelf
) -> PairFiles:
    drive, source, target = (
        pair_records.number(row, names, label)
        for names in (pair_records.SEQUENCE, pair_records.SOURCE_FRAME, pair_records.TARGET_FRAME)
    )
    clouds = []
    for names, frame in ((pair_records.SOURCE, source), (pair_records.TARGET, target)):
        listed, raw = base / str(pair_records.need(row, names, label)), Drive(base, drive).scan(frame)
        clouds.append(raw if shelf.has(raw) and not shelf.has(listed) else listed)
    T = pair_records.transform_of(row, label)
    return _pair((drive, source, target), (clouds[0], clouds[1]), T, "published")


def _own(base: Path, split: str) -> _Made:
    listed = kitti_list.read(base, split)
    entries = [
        _scanned(base, (each.drive, each.source, each.target), np.array(each.T), each.composition)
        for each in listed
    ]
    return entries, tuple(field.name for field in dataclasses.fields(kitti_list.ListedPose))


def _icp(base: Path, split: str) -> _Made:
    folder, entries = required_files.folder(base / "icp", "Predator's folder of KITTI's refined poses"), []
    for drive, source, target in kitti_list.walk(base, split):
        file = required_files.first(
            [folder / f"{drive}_{source}_{target}.npy"], f"the pose of pair {source}-{target}"
        )
        with foreign_parser(str(file), "a 4x4 pose"):
            T = rigid(np.load(file, allow_pickle=False), str(file))
        entries.append(_scanned(base, (drive, source, target), T, "M @ T_icp"))
    return entries, ()


def _odometry(base: Path, split: str) -> _Made:
    walk = kitti_list.walk(base, split)
    return [_scanned(base, each, Drive(base, each[0]).motion(*each[1:]), "odometry") for each in walk], ()


_MAKERS: dict[str, Callable[[Path, str], _Made]] = {
    "published": _published,
    "own": _own,
    "icp": _icp,
    "odometry": _odometry,
}


def _scanned(base: Path, frames: tuple[int, int, int], T: Array, poses: str) -> PairFiles:
    drive, source, target = frames
    track = Drive(base, drive)
    return _pair(frames, (track.scan(source), track.scan(target)), T, poses)


def _pair(frames: tuple[int, int, int], clouds: tuple[Path, Path], T: Array, poses: str) -> PairFiles:
    drive, source, target = frames
    return PairFiles(
        id=f"{drive:02d}/{source}-{target}",
        source=clouds[0],
        target=clouds[1],
        T_target_source=T,
        source_sensor=_SENSOR,
        target_sensor=_SENSOR,
        facts={"poses": poses},
    )
