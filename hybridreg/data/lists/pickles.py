# SPDX-License-Identifier: MIT
"""Reading untrusted pickles without running code that they carry."""

from __future__ import annotations

import io
import pickle
import pickletools
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridreg.io.faults import fault, foreign_parser
from hybridreg.io.whole_files import read_whole


def read_pickle(path: Path) -> Any:
    """The content of a pickle of plain Python containers, numbers, text and numpy arrays.

    Raises
    ------
    FileNotFoundError
        Nothing lies at `path`.
    ValueError
        The file is empty or damaged, or asks for any other class or function, which is then not imported.
    """
    return load(io.BytesIO(read_whole(path)), str(path))


def load(stream: io.BytesIO, name: str) -> Any:
    """The next pickle of a stream; as `read_pickle`."""
    if not stream.read(1):
        raise fault(name, "is empty where a pickle should begin")
    stream.seek(-1, io.SEEK_CUR)
    with foreign_parser(name, "a pickle"):
        try:
            return PlainUnpickler(stream).load()
        except Forbidden as error:
            refused = error.name
    cure = "take the file from where the data set's authors publish it; nothing of it was run"
    raise fault(name, f"asks for {refused}, which a table of numpy arrays has no use for", cure)


def globals_of(data: bytes) -> set[str]:
    """Names of the classes and functions that the first pickle in `data` asks for, without loading it."""
    strings: list[str] = []
    found = set()
    for code, argument, _ in pickletools.genops(data):
        if code.name == "GLOBAL":
            found.add(str(argument).replace(" ", "."))
        elif code.name == "STACK_GLOBAL":
            found.add(".".join(strings[-2:]))
        elif isinstance(argument, str):
            strings.append(argument)
    return found


class Forbidden(Exception):
    """A pickle asks for what no table has a use for."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.name = name


class PlainUnpickler(pickle.Unpickler):
    """Accepts only the few names that pickled numpy arrays need, and replaces them with functions of its own.

    So neither numpy's module names matter (`numpy.core` until 1.26, `numpy._core` from 2.0), nor what the real
    functions could be made to do.
    """

    def __init__(self, stream: io.BytesIO) -> None:
        super().__init__(stream, encoding="latin1")  # Python 2 wrote numpy's bytes as text

    def find_class(self, module: str, name: str) -> Any:
        full = f"{module}.{name}".replace("numpy._core", "numpy.core")
        if full not in _STAND_INS:
            raise Forbidden(f"{module}.{name}")
        # A fresh wrapper, as a pickle may also set attributes of what it was given.
        return partial(_STAND_INS[full])

    def persistent_load(self, pid: Any) -> Any:
        raise Forbidden("an object kept outside the pickle (a torch tensor's storage?)")


def _empty_array(*_: Any) -> NDArray[Any]:
    return np.empty(0, dtype=np.int8)  # the pickle then fills in shape, type and bytes


def _dtype(code: Any, *_: Any) -> np.dtype[Any]:
    return np.dtype(str(code), copy=True)


def _number(dtype: np.dtype[Any], data: bytes | str) -> Any:
    raw = data.encode("latin1") if isinstance(data, str) else data
    return np.frombuffer(raw, dtype=dtype, count=1)[0]


def _array(data: Any, dtype: np.dtype[Any], shape: tuple[int, ...], order: str = "C") -> NDArray[Any]:
    return np.frombuffer(data, dtype=dtype).reshape(shape, order="F" if order == "F" else "C")


def _latin1(text: str, *_: Any) -> bytes:
    return text.encode("latin1")


def _no_bytes() -> bytes:
    return b""  # how Python 2's protocols spell an empty array's content


def _storage(data: bytes) -> NDArray[Any]:
    # What PyTorch writes for the numbers of a tensor is an archive of its own; its reader for weights runs nothing.
    import torch

    held = torch.load(io.BytesIO(data), weights_only=True)
    return np.asarray(torch.tensor([], dtype=held.dtype).set_(held))


def _tensor(
    storage: NDArray[Any], offset: int, size: tuple[int, ...], stride: tuple[int, ...], *_: Any
) -> Any:
    steps = sum((n - 1) * step for n, step in zip(size, stride, strict=True)) if all(size) else -1
    if min((offset, *size, *stride)) < 0 or offset + steps >= len(storage):
        raise ValueError("a tensor reaches beyond its numbers")
    flat = storage[offset:]
    return np.lib.stride_tricks.as_strided(flat, size, [step * flat.itemsize for step in stride]).copy()


_STAND_INS: dict[str, Any] = {
    "numpy.core.multiarray._reconstruct": _empty_array,
    "numpy.core.multiarray.scalar": _number,
    "numpy.core.numeric._frombuffer": _array,
    "numpy.ndarray": _empty_array,
    "numpy.dtype": _dtype,
    "_codecs.encode": _latin1,
    "__builtin__.bytes": _no_bytes,
    "builtins.bytes": _no_bytes,
    "torch.storage._load_from_bytes": _storage,
    "torch._utils._rebuild_tensor_v2": _tensor,
    "collections.OrderedDict": dict,
}
