# SPDX-License-Identifier: MIT
"""Tensors computed once and stored on disk, one file for each key."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from safetensors import SafetensorError
from safetensors.torch import load_file, save
from torch import Tensor

from hybridreg.io.atomic import write_bytes

Tensors = Mapping[str, Tensor]


class NotKept(OSError):
    """The cache cannot be written: the disk is full, or the folder is read-only."""


@dataclass(frozen=True)
class TensorCache:
    """A folder of safetensors files. The system's page cache keeps them in memory.

    ``folder=None`` stores nothing and computes each time.
    """

    folder: Path | None

    def path(self, key: object) -> Path:
        """The file of a key's tensors."""
        if self.folder is None:
            raise ValueError("this cache has no folder")
        name = hashlib.sha256(repr(key).encode()).hexdigest()[:32]
        return self.folder / name[:2] / f"{name[2:]}.safetensors"

    def has(self, key: object) -> bool:
        """Whether they are stored."""
        return self.folder is not None and self.path(key).is_file()

    def get(self, key: object, make: Callable[[], Tensors], *, must_keep: bool = True) -> Tensors:
        """The tensors of a key, read or computed; a damaged file is replaced.

        ``must_keep=False`` returns them even where they cannot be written.

        Raises
        ------
        NotKept
            They cannot be written.
        """
        if self.folder is None:
            return make()
        path = self.path(key)
        if path.is_file():
            try:
                return load_file(path)
            except SafetensorError:
                path.unlink(missing_ok=True)
        tensors = make()
        content = save({name: tensor.contiguous() for name, tensor in tensors.items()})
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(path, content)
        except OSError as error:
            if must_keep:
                raise NotKept(error.errno, error.strerror, os.fspath(path)) from error
        return tensors
