# SPDX-License-Identifier: MIT
"""A file that grows by whole lines, each on disk before the next."""

from __future__ import annotations

import os
from pathlib import Path

from hybridreg.io.faults import naming


class LineFile:
    """Appends lines to `path`; a line that does not fit on the disk leaves no partial line behind.

    Raises
    ------
    OSError
        A full disk, a folder that cannot be written to; it names the file.
    """

    def __init__(self, path: Path, *, anew: bool) -> None:
        self.path = path
        flags = (
            os.O_WRONLY | os.O_CREAT | os.O_APPEND | (os.O_TRUNC if anew else 0) | getattr(os, "O_BINARY", 0)
        )
        with naming(path):
            self._handle = os.open(path, flags, 0o666)

    def add(self, line: str) -> None:
        """Append a line (without its end)."""
        left = (line + "\n").encode("utf-8", "backslashreplace")
        with naming(self.path):
            before = os.fstat(self._handle).st_size
            try:
                while left:
                    left = left[os.write(self._handle, left) :]
                os.fsync(self._handle)
            except BaseException as error:
                # A line that is complete but was interrupted before the flush may stay.
                if left or isinstance(error, OSError):
                    os.ftruncate(self._handle, before)
                raise

    def is_there(self) -> bool:
        """Is the file still the one of that name?"""
        try:
            return os.path.samestat(os.fstat(self._handle), os.stat(self.path))
        except FileNotFoundError:
            return False

    def close(self) -> None:
        """Close the file."""
        os.close(self._handle)


def whole_lines(path: Path) -> tuple[list[str], int]:
    """The complete lines of a file, and their number of bytes: what follows was cut off by a crash.

    Raises
    ------
    UnicodeDecodeError
        Not text.
    """
    data = path.read_bytes()
    end = data.rfind(b"\n") + 1
    return data[:end].decode("utf-8").splitlines(), end


def cut(path: Path, length: int) -> None:
    """Cut a file behind its complete lines, `length` bytes."""
    with naming(path):
        os.truncate(path, length)
