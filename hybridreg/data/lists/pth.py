# SPDX-License-Identifier: MIT
"""3DMatch's fragments: arrays that PyTorch saved as `.pth`."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.data.lists import pickles
from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.formats.torch_file import parse_torch
from hybridreg.io.whole_files import read_whole

# PyTorch before 1.6 wrote several pickles in a row; the first is this number.
_OLD_FORMAT = 0x1950A86A20F9469CFC6C


def read_pth(path: Path) -> NDArray[np.float64]:
    """Points (N, 3) of a `.pth` file that holds an array or a tensor, without running what it carries.

    The published fragments are numpy arrays, which PyTorch's own safe reader refuses; tensors are read by that.

    Raises
    ------
    FileNotFoundError
        Nothing lies at `path`.
    ValueError
        Damaged, not points, or with a class that an array does not need.
    ImportError
        A tensor, without torch installed.
    """
    data, name = read_whole(path), str(path)
    if not data:
        raise fault(name, "is empty (0 bytes)")
    content = _from_zip(data, name) if data.startswith(b"PK") else _from_stream(data, name)
    points = np.asarray(content)
    if points.ndim != 2 or points.shape[1] < 3 or points.dtype.kind not in "fiu":
        problem = f"holds {type(content).__name__} of shape {points.shape}, not points"
        raise fault(name, problem, "give a fragment of 3DMatch, an array of shape (N, 3)")
    return np.array(points[:, :3], dtype=np.float64)


def _from_zip(data: bytes, name: str) -> Any:
    with foreign_parser(name, "a PyTorch archive"), zipfile.ZipFile(io.BytesIO(data)) as archive:
        member = next((m for m in archive.namelist() if m.endswith("data.pkl")), None)
        inner = b"" if member is None else archive.read(member)
    if not inner:
        raise fault(name, "has no data.pkl inside, so PyTorch did not write it")
    return _tensor(data, name) if _is_tensor(inner, name) else pickles.load(io.BytesIO(inner), name)


def _from_stream(data: bytes, name: str) -> Any:
    stream = io.BytesIO(data)
    if pickles.load(stream, name) != _OLD_FORMAT:
        raise fault(name, "does not begin like a file of PyTorch")
    for _ in range(2):  # the protocol's number, and the sizes of types on the machine that wrote it
        pickles.load(stream, name)
    if _is_tensor(data[stream.tell() :], name):
        return _tensor(data, name)
    return pickles.load(stream, name)


def _is_tensor(data: bytes, name: str) -> bool:
    with foreign_parser(name, "a pickle"):
        return any(each.startswith("torch.") for each in pickles.globals_of(data))


def _tensor(data: bytes, name: str) -> Any:
    tensor = parse_torch(data, name)
    with foreign_parser(name, "a PyTorch tensor"):
        return tensor.detach().numpy()
