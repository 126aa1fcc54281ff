# SPDX-License-Identifier: MIT
"""Objects of drivers, development kits and tools that hold points, stand-ins for some, and objects that only claim
to."""

from __future__ import annotations

from collections import namedtuple
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_Return = namedtuple("_Return", "intensity x y z")


class Frame:
    """As a DataFrame: columns by name and by place."""

    def __init__(self, columns: dict[str, Any]) -> None:
        self._columns = columns
        self.columns = list(columns)
        self.iloc = self

    def __getitem__(self, key: Any) -> Any:
        return self._columns[self.columns[key[1]] if isinstance(key, tuple) else key]


class Absent:
    """Has every attribute, none of which means anything."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Absent()

    def __call__(self, *given: Any, **named: Any) -> Any:
        return Absent()


class Endless:
    """Holds points that hold points, without end."""

    @property
    def points(self) -> Any:
        return Endless()


def _by_axis(points: Array, names: str = "xyz") -> dict[str, Any]:
    return dict(zip(names, points.T, strict=True))


def _records(points: Array, kind: str = "f8", **layout: Any) -> NDArray[Any]:
    names = layout.get("names", list("zxy"))
    spec: Any = {"names": names, "formats": [kind] * len(names)}
    if "offsets" in layout:
        spec |= {"offsets": layout["offsets"], "itemsize": 40}
    rows = np.zeros(len(points), spec)
    for axis, values in zip("xyz", points.T, strict=True):
        if axis in names:
            rows[axis] = values if kind[-2] == "f" else np.nan_to_num(values)
    return rows


def _message(points: Array, *, step: int = 16, kind: int = 7, cut: int = 0, offset: int = 0) -> Any:
    rows = np.zeros((len(points), 4), "<f4")
    rows[:, :3] = points
    fields = [
        SimpleNamespace(name=axis, offset=offset + 4 * k, datatype=kind, count=1)
        for k, axis in enumerate("xyz")
    ]
    data = rows.tobytes()
    return SimpleNamespace(
        fields=fields, point_step=step, row_step=step * len(points), width=len(points), height=1, is_bigendian=False,
        data=data[: len(data) - cut],
    )  # fmt: skip


def _masked_records(points: Array) -> Any:
    return np.ma.masked_array(_records(points), mask=np.arange(len(points)) % 3 == 0)


def _laspy(points: Array) -> Any:
    import laspy

    las = laspy.LasData(laspy.LasHeader(point_format=3, version="1.2"))
    las.x, las.y, las.z = np.clip(np.nan_to_num(points), -1e6, 1e6).T
    return las


def _mesh(tensor: bool) -> Any:
    from hybridreg.runtime.open3d import load_open3d

    o3d = load_open3d()
    return (o3d.t if tensor else o3d).geometry.TriangleMesh.create_box()


def _small_gicp(points: Array) -> Any:
    import small_gicp

    return small_gicp.PointCloud(np.ascontiguousarray(points))


MAKE: dict[str, Callable[[Array], Any]] = {
    "records": _records,
    "records of floats": lambda p: _records(p, "<f4"),
    "big-endian records": lambda p: _records(p, ">f8"),
    "records of integers": lambda p: _records(p, "<i4"),
    "padded records": lambda p: _records(p, "<f4", offsets=[16, 0, 8]),
    "overlapping records": lambda p: _records(p, "<f4", offsets=[2, 0, 1]),
    "records without z": lambda p: _records(p, names=["x", "y", "w"]),
    "masked records": _masked_records,
    "masked integers": lambda p: np.ma.masked_array(np.nan_to_num(p).astype(int), mask=p > 5.0),
    "all masked": lambda p: np.ma.masked_all(p.shape),
    "axes": _by_axis,
    "axes in millimetres": lambda p: _by_axis(p * 1e3, ("x (mm)", "Y [mm]", "z_mm")),  # type: ignore[arg-type]
    "axes in degrees": lambda p: _by_axis(p, ("x (deg)", "y (deg)", "z (m)")),  # type: ignore[arg-type]
    "axes of mixed units": lambda p: _by_axis(p, ("x (mm)", "y (m)", "z (m)")),  # type: ignore[arg-type]
    "axes of unequal length": lambda p: {"x": p[:, 0], "y": p[1:, 1], "z": p[:, 2]},
    "axes of texts": lambda p: {"x": ["far"] * len(p), "y": p[:, 1], "z": p[:, 2]},
    "e57 scan": lambda p: _by_axis(p, ("cartesianX", "cartesianY", "cartesianZ")),  # type: ignore[arg-type]
    "frame": lambda p: Frame(_by_axis(p[:, ::-1], "zyx")),
    "frame without names": lambda p: Frame(dict(enumerate(p.T))),  # type: ignore[arg-type]
    "frame of others": lambda p: Frame(_by_axis(p, "abc")),
    "frame of nothing": lambda p: Frame({}),
    "mappings": lambda p: [_by_axis(row, "xyz") for row in p],
    "named tuples": lambda p: [_Return(1, *row) for row in p.tolist()],
    "objects": lambda p: [SimpleNamespace(x=a, y=b, z=c) for a, b, c in p.tolist()],
    "objects of unlike kinds": lambda p: [SimpleNamespace(x=1.0, y=2.0, z=3.0), *p.tolist()],
    "message": _message,
    "message cut short": lambda p: _message(p, cut=7),
    "message of an odd step": lambda p: _message(p, step=5),
    "message of no step": lambda p: _message(p, step=0),
    "message beyond its end": lambda p: _message(p, offset=100),
    "message of unknown types": lambda p: _message(p, kind=99),
    "channels first": lambda p: np.column_stack([p, np.ones(len(p))]).T,
    "organised": lambda p: p[: len(p) // 10 * 10].reshape(10, -1, 3),
    "stack of clouds": lambda p: np.stack([p, p]),
    "numbered": lambda p: np.column_stack([np.arange(len(p)), p]),
    "no returns": lambda p: np.where(np.arange(len(p))[:, None] % 3 == 0, 0.0, p),
    "memoryview": lambda p: memoryview(np.ascontiguousarray(p)),
    "bytes": lambda p: p.tobytes(),
    "method": lambda p: SimpleNamespace(points=lambda: p),
    "dev kit": lambda p: SimpleNamespace(points=np.column_stack([p, np.ones(len(p))]).T),
    "mesh": lambda p: SimpleNamespace(vertices=p, faces=np.zeros((4, 3), int)),
    "mesh without faces": lambda p: SimpleNamespace(vertices=p, faces=np.zeros((0, 3), int)),
    "open3d mesh": lambda p: _mesh(False),
    "open3d tensor mesh": lambda p: _mesh(True),
    "laspy": _laspy,
    "laspy record": lambda p: _laspy(p).points,
    "raw las record": lambda p: _laspy(p).points.array,
    "small_gicp": _small_gicp,
    "absent": lambda p: Absent(),
    "endless": lambda p: Endless(),
}  # fmt: skip

TAKEN = ("records", "records of floats", "big-endian records", "padded records", "masked records", "axes", "e57 scan",
         "axes in millimetres", "frame", "named tuples", "objects", "message", "channels first", "organised", "method",
         "dev kit", "no returns", "laspy", "small_gicp", "memoryview")  # fmt: skip
"""Those that the library reads."""
