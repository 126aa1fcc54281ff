# SPDX-License-Identifier: MIT
"""Reading a file's bytes, with an error that says what is at the path instead of a file."""

from __future__ import annotations

from pathlib import Path

from hybridreg.io.faults import fault


def check_file(path: Path) -> None:
    """Refuse a missing path, a folder, a device, a pipe, and a name that no file can have."""
    try:
        if path.is_dir():
            raise IsADirectoryError(f"{path}: is a folder; name one file inside it")
        if not path.exists():
            raise FileNotFoundError(
                f"{path}: no such file; check the name (the current folder is {Path.cwd()})"
            )
        if not path.is_file():
            raise ValueError(f"{path}: is a device or a pipe; copy its content to a file first")
    except (FileNotFoundError, IsADirectoryError):
        raise
    except OSError as error:  # a name that is too long, a share that is gone
        raise ValueError(
            f"{str(path)[:200]}: cannot be looked up ({error.strerror}); check the name"
        ) from error


def read_whole(path: Path) -> bytes:
    """All bytes of the file at `path`."""
    check_file(path)
    try:
        return path.read_bytes()
    except MemoryError as error:
        size = path.stat().st_size
        raise fault(str(path), f"its {size} bytes do not fit in memory", "cut it into parts") from error
