# SPDX-License-Identifier: MIT
"""Small trees in PandaSet's layout, written by pandas, and as pandas wrote them in 2020."""

from __future__ import annotations

import gzip
import io
import json
import pickle
import types
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from loader_trees import Array, street, way
from scipy.spatial.transform import Rotation

from hybridreg.data.loaders import pandaset
from hybridreg.geometry import se3

COLUMNS = ("x", "y", "z", "i", "t", "d")


def columns_of(car: Array) -> dict[str, Any]:
    """What both sensors see of the street from a car's pose, in the world; five points are its roof."""
    spinning = car @ pandaset._CAR_PANDAR64
    forward = spinning @ pandaset._PANDAR64_PANDARGT
    world = street()
    around = np.linalg.norm(se3.apply(se3.inverse(spinning), world), axis=1) < 30.0
    ahead = se3.apply(se3.inverse(forward), world)
    # The forward sensor looks along y, 60 degrees wide.
    fan = (np.abs(np.degrees(np.arctan2(ahead[:, 0], ahead[:, 1]))) < 30.0) & (
        np.linalg.norm(ahead, axis=1) < 45.0
    )
    roof = se3.apply(spinning, np.random.default_rng(0).uniform(-1.0, 1.0, (5, 3)))
    points = np.vstack([world[around], roof, world[fan]])
    d = np.repeat([0, 1], [around.sum() + 5, fan.sum()])
    table = {axis: points[:, k] for k, axis in enumerate("xyz")}
    return {**table, "i": np.linspace(0, 255, len(d)), "t": np.full(len(d), 1.5e9), "d": d.astype(np.int64)}


def write(root: Path, sequence: str = "005", n: int = 14, pack: Any = None) -> Array:
    """One sequence of ``n`` frames; the car's poses (n, 4, 4), y forward."""
    import cv2

    # `way` drives along x: turned so that y is ahead, and stood on the street's ground.
    ahead = se3.from_rt(Rotation.from_euler("z", -90.0, degrees=True).as_matrix(), np.array([0.0, 0.0, -1.7]))
    car = np.stack([pose @ ahead for pose in way(n)])
    drive = root / sequence
    (drive / "lidar").mkdir(parents=True)
    (drive / "camera" / "front_camera").mkdir(parents=True)
    for frame, pose in enumerate(car):
        data = (pack or by_pandas)(columns_of(pose))
        (drive / "lidar" / f"{frame:02d}.pkl.gz").write_bytes(gzip.compress(data, 1))
        picture = np.full((54, 96, 3), frame, np.uint8)
        cv2.imwrite(str(drive / "camera" / "front_camera" / f"{frame:02d}.jpg"), picture)
    (drive / "lidar" / "poses.json").write_text(json.dumps([_told(pose) for pose in car]))
    return car


def _told(pose: Array) -> dict[str, Any]:
    heading = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return {
        "position": dict(zip("xyz", pose[:3, 3].tolist(), strict=True)),
        "heading": dict(zip("xyzw", heading.tolist(), strict=True)),
    }


def by_pandas(columns: dict[str, Any]) -> bytes:
    """As today's pandas pickles a table."""
    import pandas

    return pickle.dumps(pandas.DataFrame(columns))


def by_old_pandas(columns: dict[str, Any]) -> bytes:
    """As pandas 1.0 did, class by class, without it."""
    labels = _Index([*columns])
    floats = np.stack([columns[name] for name in columns if name != "d"])
    blocks = [
        {"values": floats, "mgr_locs": np.array([k for k, name in enumerate(columns) if name != "d"])},
        {"values": columns["d"][None], "mgr_locs": slice(len(columns) - 1, len(columns), 1)},
    ]
    axes = [labels, _Index(list(range(len(columns["d"]))))]
    manager = _BlockManager(
        (axes, [b["values"] for b in blocks], [labels], {"0.14.1": {"axes": axes, "blocks": blocks}})
    )
    frame = _DataFrame()
    frame.__dict__.update({"_data": manager, "_typ": "dataframe", "_metadata": [], "attrs": {}})
    stream = io.BytesIO()
    _Unverified(stream, 4).dump(frame)
    return stream.getvalue()


class _Index:
    def __init__(self, labels: list[Any]) -> None:
        self.labels = labels

    def __reduce__(self) -> Any:
        return _new_index, (type(self), {"data": np.array(self.labels, dtype=object), "name": None}), None


class _BlockManager:
    def __init__(self, state: Any) -> None:
        self.state = state

    def __reduce_ex__(self, protocol: Any) -> Any:
        import copyreg

        return copyreg.__newobj__, (type(self),), self.state  # type: ignore[attr-defined]


class _DataFrame:
    pass


def _new_index(cls: Any, told: Any) -> Any:
    raise AssertionError("only named in pickles")


_NAMES: dict[Any, str] = {
    _Index: "pandas.core.indexes.base\nIndex",
    _BlockManager: "pandas.core.internals.managers\nBlockManager",
    _DataFrame: "pandas.core.frame\nDataFrame",
    _new_index: "pandas.core.indexes.base\n_new_Index",
}


class _Unverified(pickle._Pickler):  # type: ignore[name-defined,misc]
    """Writes pandas' names for the classes here."""

    dispatch: ClassVar[dict[Any, Any]] = dict(pickle._Pickler.dispatch)  # type: ignore[attr-defined]

    def save_global(self, obj: Any, name: Any = None) -> None:
        if obj in _NAMES:
            self.write(pickle.GLOBAL + _NAMES[obj].encode() + b"\n")
            self.memoize(obj)
        else:
            super().save_global(obj, name)

    dispatch[types.FunctionType] = save_global
