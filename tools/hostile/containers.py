# SPDX-License-Identifier: MIT
"""Containers of points, and other objects passed by mistake."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tools.hostile import objects

Array = NDArray[np.float64]


def contain(points: Array, name: str) -> Any:
    """Points (n, 3) in a container of that name."""
    with np.errstate(all="ignore"):
        return (_MAKE | objects.MAKE)[name](points)


def _torch(points: Array, dtype: str, **options: Any) -> Any:
    import torch

    return torch.tensor(points).to(getattr(torch, dtype)).requires_grad_(options.get("grad", False))


def _sparse(points: Array) -> Any:
    import torch

    return torch.tensor(points).to_sparse()


def _open3d(points: Array, tensor: bool) -> Any:
    from hybridreg.runtime.open3d import load_open3d

    o3d = load_open3d()
    if tensor:
        return o3d.t.geometry.PointCloud(o3d.core.Tensor(np.ascontiguousarray(points)))
    return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(np.ascontiguousarray(points)))


def _empty_tensor_cloud(points: Array) -> Any:
    from hybridreg.runtime.open3d import load_open3d

    return load_open3d().t.geometry.PointCloud()


def _strided(points: Array) -> Array:
    wide = np.zeros((2 * len(points), 8))
    wide[::2, 1:4] = points
    return wide[::2, 1:4]


def _structured(points: Array) -> NDArray[Any]:
    return np.rec.fromarrays(points.T, names="x,y,z")


def _ragged(points: Array) -> Any:
    return [[1.0, 2.0, 3.0]] * 30 + [[1.0, 2.0]]


def _cyclic(points: Array) -> Any:
    held: list[Any] = []
    held.append(held)
    return held


class Liar:
    """Claims to hold points, and raises on access."""

    @property
    def points(self) -> Any:
        raise RuntimeError("the device is gone")


class BadArray:
    """Its conversion to an array raises something that numpy passes on."""

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        raise OSError("the file behind this array was closed")


_MAKE: dict[str, Callable[[Array], Any]] = {
    "float64": lambda p: p,
    "float32": lambda p: p.astype(np.float32),
    "float16": lambda p: p.astype(np.float16),
    "longdouble": lambda p: p.astype(np.longdouble),
    "int64": lambda p: np.nan_to_num(p).astype(np.int64),
    "int8": lambda p: np.nan_to_num(p).astype(np.int8),
    "uint16": lambda p: np.nan_to_num(p).astype(np.uint16),
    "bool": lambda p: p.astype(bool),
    "complex": lambda p: p.astype(complex),
    "text": lambda p: p.astype(str),
    "bytes": lambda p: p.astype("S8"),
    "datetime": lambda p: np.zeros(p.shape, "datetime64[s]"),
    "object": lambda p: p.astype(object),
    "big endian": lambda p: p.astype(">f8"),
    "list": lambda p: p.tolist(),
    "tuples": lambda p: [tuple(row) for row in p.tolist()],
    "generator": lambda p: (row for row in p),
    "fortran": lambda p: np.asfortranarray(p),
    "strided": _strided,
    "reversed": lambda p: p[::-1, ::-1],
    "read-only": lambda p: np.frombuffer(p.tobytes()).reshape(-1, 3),
    "broadcast": lambda p: np.broadcast_to(p[:1], p.shape) if len(p) else p,
    "transposed": lambda p: p.T,
    "two columns": lambda p: p[:, :2],
    "four columns": lambda p: np.column_stack([p, np.full(len(p), np.nan)]),
    "flat": lambda p: p.ravel(),
    "batched": lambda p: p[None],
    "scalar": lambda p: np.float64(3.0),
    "matrix": lambda p: np.asmatrix(p),
    "masked": lambda p: np.ma.masked_array(p, mask=p > 5.0),
    "structured": _structured,
    "ragged": _ragged,
    "cyclic": _cyclic,
    "none": lambda p: None,
    "dictionary": lambda p: {"points": p},
    "namespace": lambda p: SimpleNamespace(points=p),
    "number": lambda p: 7,
    "class": lambda p: np.ndarray,
    "liar": lambda p: Liar(),
    "bad array": lambda p: BadArray(),
    "huge integers": lambda p: [[10**400, 1, 2]] * 30,
    "torch double": lambda p: _torch(p, "float64"),
    "torch float": lambda p: _torch(p, "float32", grad=True),
    "torch half": lambda p: _torch(p, "float16"),
    "torch bfloat16": lambda p: _torch(p, "bfloat16"),
    "torch complex": lambda p: _torch(p, "complex64"),
    "torch sparse": _sparse,
    "open3d": lambda p: _open3d(p, tensor=False),
    "open3d tensor": lambda p: _open3d(p, tensor=True),
    "open3d empty tensor": _empty_tensor_cloud,
}  # fmt: skip

CONTAINERS = (*_MAKE, *objects.MAKE)
TAKEN = ("float32", "float16", "big endian", "list", "fortran", "strided", "reversed", "read-only", "four columns",
         "masked", "namespace", "torch float", "torch bfloat16", "open3d", "open3d tensor", *objects.TAKEN)  # fmt: skip
"""Those that hold points which the library reads."""
