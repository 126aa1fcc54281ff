# SPDX-License-Identifier: MIT
"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import re
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hybridreg.io.faults import naming

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

# What `atomic_path` calls the files that it gives.
_TEMPORARY = re.compile(r"\.[0-9a-f]{16}(\.[^.]*)?")


@contextmanager
def atomic_path(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary file to write to; it takes the place of `path` when the block ends well.

    The temporary file lies in the same folder and has the same suffix (many writers choose their format by
    it). It is flushed to the disk before it is renamed, so that after a crash `path` holds either the old
    content or the new. When the block raises, the temporary file is removed and `path` is as it was.

    Parameters
    ----------
    path : path
        The file to write. A symbolic link is followed, not replaced.

    Yields
    ------
    Path
        An existing, empty file to write to or over.

    Raises
    ------
    FileNotFoundError
        The folder of `path` does not exist.
    IsADirectoryError
        `path` is a folder.
    ValueError
        `path` is a device or a pipe, which a rename would destroy.
    OSError
        A full disk, a folder that cannot be written to; it names `path`.
    """
    target = check_target(path)
    temporary = target.with_name(f".{secrets.token_hex(8)}{target.suffix}")
    with naming(path, instead_of=temporary), _made(temporary):
        try:
            yield temporary
            if target.exists():
                shutil.copymode(target, temporary)
            _flush_to_disk(temporary)
            os.replace(temporary, target)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
        _flush_folder(target.parent)


def write_bytes(path: str | os.PathLike[str], data: bytes) -> None:
    """Write `data` to `path`, whole or not at all (see `atomic_path`)."""
    with atomic_path(path) as temporary:
        temporary.write_bytes(data)


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write `text` to `path` as UTF-8 with newlines as given, whole or not at all (see `atomic_path`).

    Bytes of a file's name that are not UTF-8 arrive as lone surrogates, and are written as ``\\udcff``.
    """
    write_bytes(path, text.encode("utf-8", "backslashreplace"))


def check_target(path: str | os.PathLike[str]) -> Path:
    """Where `atomic_path` writes, refused as it would refuse it."""
    target = Path(os.path.realpath(path))
    if target.is_dir():
        raise IsADirectoryError(f"{path}: is a folder; name a file inside it")
    if target.exists() and not target.is_file():
        raise ValueError(f"{path}: is a device or a pipe, not a file; choose another name")
    if not target.parent.is_dir():
        raise FileNotFoundError(f"{path}: the folder {target.parent} does not exist; create it first")
    return target


def sweep(folder: str | os.PathLike[str]) -> None:
    """Remove what killed processes were writing in a folder: temporary files of `atomic_path` that nobody holds.

    Where the system or the file system knows no locks, nothing is removed.
    """
    for path in Path(folder).glob(".*"):
        if _TEMPORARY.fullmatch(path.name) and path.is_file():
            with suppress(OSError), path.open("rb") as file:
                if _locked(file.fileno()):
                    path.unlink(missing_ok=True)


@contextmanager
def _made(temporary: Path) -> Iterator[None]:
    # Held until it has taken its place, so that `sweep` leaves it alone. Not tempfile: its files are readable by their
    # owner alone, whatever the umask says.
    while True:
        handle = os.open(temporary, os.O_CREAT | os.O_RDWR, 0o666)
        _locked(handle)
        if temporary.exists():  # else swept before it was held
            break
        os.close(handle)
    if fcntl is None:  # and no file that is open can be renamed
        os.close(handle)
        yield
        return
    try:
        yield
    finally:
        os.close(handle)


def _locked(handle: int) -> bool:
    if fcntl is None:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def _flush_to_disk(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _flush_folder(folder: Path) -> None:
    # The rename itself lives in the folder. Windows cannot open a folder, and needs no such step.
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
