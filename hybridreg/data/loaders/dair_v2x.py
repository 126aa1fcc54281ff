# SPDX-License-Identifier: MIT
"""DAIR-V2X: a 300-line LiDAR over a crossing against a car's 40 beams, with images (Yu et al., CVPR 2022)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.lists import drive_splits, required_files
from hybridreg.data.lists.listed import ListedPairs
from hybridreg.data.lists.pair_files import PairFiles
from hybridreg.data.lists.trajectories import rigid
from hybridreg.geometry import se3
from hybridreg.io.faults import fault, shorten
from hybridreg.io.structured import read_json

Array = NDArray[np.float64]

_ROAD, _CAR = "infrastructure-side", "vehicle-side"
CURE = "the archive's own calibration maps each LiDAR to the world; take it anew from its authors"


class DairV2x(ListedPairs):
    """The roadside's cloud and image (source) against the car's cloud of the same moment (target).

    Both are carried to the world by the published calibration; where the list tells a `system_error_offset`, the
    roadside's position is moved by it, as the authors' own code does. The truth is good to some decimetres.

    Parameters
    ----------
    root : path
        `cooperative-vehicle-infrastructure` of the archive, or above it: `cooperative/data_info.json`,
        `infrastructure-side` and `vehicle-side` with `velodyne`, `image` and `calib`.
    split : str
        Ours, by the number of the car's drive (`batch_id` of `vehicle-side/data_info.json`): it ends with 0 or 5 in
        "test", with 9 in "val", else "train"; "all" is each, and asks for no drive.
    distance : float
        Metres that the two sensors stand apart at most; 0 takes all.

    Raises
    ------
    FileNotFoundError
        Saying what is missing and where it must lie.
    ValueError
        A list or a calibration that is none, an unknown split, or no pairs that fit.
    """

    def __init__(self, root: str | os.PathLike[str], split: str = "test", distance: float = 0.0) -> None:
        drive_splits.check_split(split, "DAIR-V2X")
        if not distance >= 0.0:
            raise ValueError(f"distance={distance} must not be negative")
        base = required_files.folder(Path(root), "DAIR-V2X")
        inner = base / "cooperative-vehicle-infrastructure"
        base = inner if inner.is_dir() else base
        listed = required_files.first([base / "cooperative" / "data_info.json"], "DAIR-V2X's list of pairs")
        rows = _records(listed)
        drives = {} if split == "all" else _drives(base)
        entries = []
        for n, row in enumerate(rows):
            label = f"{listed}, pair {n}"
            car = _frame(row, "vehicle", label)
            if split != "all" and drive_splits.split_of(drives.get(car, "")) != split:
                continue
            entry = _entry(base, row, _frame(row, "infrastructure", label), car, label)
            if not distance or np.linalg.norm(entry.T_target_source[:3, 3]) <= distance:
                entries.append(entry)
        super().__init__(entries, listed, if_inverted=CURE, fields=tuple(map(str, rows[0])))


def _entry(base: Path, row: Mapping[str, Any], road: str, car: str, label: str) -> PairFiles:
    offset = row.get("system_error_offset") or {}
    T_world_road = _motion(base / _ROAD / "calib" / "virtuallidar_to_world" / f"{road}.json")
    try:
        moved = [float(offset.get(key, 0.0)) for key in ("delta_x", "delta_y")]
    except (AttributeError, TypeError, ValueError) as error:
        told = f"has the system_error_offset {shorten(offset)}"
        raise fault(label, told, "it is delta_x and delta_y, metres") from error
    T_world_road[:2, 3] += moved
    calib = base / _CAR / "calib"
    mount = _motion(calib / "lidar_to_novatel" / f"{car}.json")
    T_world_car = _motion(calib / "novatel_to_world" / f"{car}.json") @ mount
    shelf = required_files.Shelf()
    image = base / _ROAD / "image" / f"{road}.jpg"
    return PairFiles(
        id=f"{road}-{car}",
        source=base / _ROAD / "velodyne" / f"{road}.pcd",
        target=base / _CAR / "velodyne" / f"{car}.pcd",
        image=shelf.variant(image, required_files.IMAGES),
        T_target_source=se3.inverse(T_world_car) @ T_world_road,
        source_sensor="300-line roadside LiDAR",
        target_sensor="40-beam LiDAR of the car",
    )


def _records(path: Path) -> list[Mapping[str, Any]]:
    told = read_json(path)
    if not isinstance(told, list) or not all(isinstance(row, Mapping) for row in told):
        raise fault(str(path), "is no list of pairs", "give the archive's cooperative/data_info.json")
    if not told:
        raise fault(str(path), "lists 0 pairs")
    return told


def _drives(base: Path) -> dict[str, str]:
    what = "the list of the car's frames, which the split goes by"
    path = required_files.first([base / _CAR / "data_info.json"], what)
    return {
        PurePosixPath(str(row.get("pointcloud_path", row.get("frame_id", "")))).stem: str(
            row.get("batch_id", row.get("sequence_id", ""))
        )
        for row in _records(path)
    }


def _frame(row: Mapping[str, Any], side: str, label: str) -> str:
    """Name of a side's frame: the list of the first archive tells paths, that of the sequences names."""
    value = row.get(f"{side}_pointcloud_path", row.get(f"{side}_frame"))
    name = PurePosixPath(str(value).replace("\\", "/")).stem if value is not None else ""
    if not name or name in (".", ".."):
        raise fault(label, f"has no {side}_pointcloud_path", "give the archive's cooperative/data_info.json")
    return name


def _motion(path: Path) -> Array:
    told = read_json(required_files.first([path], "a calibration of DAIR-V2X"))
    told = told.get("transform", told) if isinstance(told, Mapping) else told
    try:
        R = np.array(told["rotation"], dtype=np.float64).reshape(3, 3)
        t = np.array(told["translation"], dtype=np.float64).reshape(3)
    except (KeyError, TypeError, ValueError) as error:
        raise fault(str(path), "has no rotation of nine numbers and translation of three") from error
    return rigid(se3.from_rt(R, t), str(path))
