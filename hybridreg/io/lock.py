# SPDX-License-Identifier: MIT
"""One writer at a time: a lock that ends with its process, however that ends, and names its holder to others."""

from __future__ import annotations

import os
import secrets
import warnings
import weakref
from contextlib import suppress
from pathlib import Path

from hybridreg.io import atomic
from hybridreg.io.faults import naming
from hybridreg.io.owner import Owner

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

_NAME = ".hybridreg-lock"


class InUse(ValueError):
    """Another process is writing there; the message says which, and since when."""


class Lock:
    """Holds the file `path` within a `with` block; what a killed writer left half written beside it is removed.

    The system's own lock (flock) lies on the file, so that it ends with a killed owner. Where the file system has no
    locks, the existence of the file is the lock: one left by an ended process of this host is taken over, one of
    another host must be deleted by hand, with a warning.

    Parameters
    ----------
    path : the lock file, removed when the block ends
    what : what is being written, for messages

    Raises
    ------
    InUse
        Another process, or another place in this one, holds it.
    OSError
        The folder cannot be written to.
    """

    def __init__(self, path: str | os.PathLike[str], what: str) -> None:
        self.path, self.what = Path(path), what
        self._handle: int | None = None

    def __enter__(self) -> Lock:
        with naming(self.what, instead_of=self.path):
            self._handle = self._taken()
        _HELD.add(self)
        atomic.sweep(self.path.parent)
        return self

    def __exit__(self, *_: object) -> None:
        handle, self._handle = self._handle, None
        if handle is None:
            return
        # Removed while it is held: who has opened it in the meantime sees that it is no longer the file of that name.
        if os.name == "posix" and _is_the_file(handle, self.path):
            self.path.unlink(missing_ok=True)
        os.close(handle)
        if os.name != "posix":  # where a file that is open cannot be removed
            self.path.unlink(missing_ok=True)

    def renew(self) -> None:
        """Take the lock again where its file was deleted.

        Raises
        ------
        InUse
            Another process has taken it since.
        """
        if self._handle is not None and not _is_the_file(self._handle, self.path):
            os.close(self._handle)
            self._handle = None
            self._handle = self._taken()

    def sweep(self) -> None:
        """Remove what a killed owner left."""
        if self.path.exists():
            with suppress(InUse, OSError), self:
                pass

    def let_go(self) -> None:
        """Forget the lock but do not end it: a forked child shares the open file and is not the owner."""
        handle, self._handle = self._handle, None
        if handle is not None:
            os.close(handle)

    def _taken(self) -> int:
        while True:
            try:
                handle, is_new = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o666), True
            except FileExistsError:
                try:
                    handle, is_new = os.open(self.path, os.O_RDWR), False
                except FileNotFoundError:  # its owner has just removed it
                    continue
            try:
                if not _flock(handle):
                    self._warn()
                    if not is_new:
                        self._remove_if_gone(handle)
                if _is_the_file(handle, self.path):
                    os.ftruncate(handle, 0)
                    os.lseek(handle, 0, os.SEEK_SET)
                    os.write(handle, Owner.here().note())
                    return handle
            except BlockingIOError:
                told = _told(handle)
                os.close(handle)
                raise InUse(self._refusal(told)) from None
            except BaseException:
                os.close(handle)
                raise
            os.close(handle)

    def _remove_if_gone(self, handle: int) -> None:
        told = _told(handle)
        if told is None or not told.is_gone():
            raise InUse(f"{self._refusal(told)}; if that run is over, delete {self.path}")
        # Moved first: of two that find it, one moves it, and the other sees that it is no longer this file.
        aside = self.path.with_name(f"{self.path.name}-{secrets.token_hex(4)}")
        if _is_the_file(handle, self.path):
            os.replace(self.path, aside)
            aside.unlink(missing_ok=True)

    def _warn(self) -> None:
        warnings.warn(
            f"{self.what}: this file system knows no locks; keep other hosts from writing there",
            UserWarning,
            stacklevel=4,
        )

    def _refusal(self, told: Owner | None) -> str:
        who = told or "another process"
        return f"{self.what} is being written by {who}; wait for it, end it, or write to another path"


def folder_lock(folder: str | os.PathLike[str], part: str = "") -> Lock:
    """The lock of a folder of results, or of a part of it."""
    return Lock(Path(folder) / f"{_NAME}{part and '-'}{part}", os.fspath(folder))


def file_lock(file: str | os.PathLike[str]) -> Lock:
    """The lock of a single file, next to it."""
    path = Path(file)
    return Lock(path.with_name(f".{path.name}{_NAME}"), os.fspath(file))


_HELD: weakref.WeakSet[Lock] = weakref.WeakSet()


def _let_go_of_all() -> None:
    for lock in list(_HELD):
        lock.let_go()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_let_go_of_all)


def _flock(handle: int) -> bool:
    # False where there are no locks; BlockingIOError where another process holds it.
    if fcntl is None:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise
    except OSError:  # ENOLCK, ENOSYS, ENOTSUP, EINVAL: every network file system has its own
        return False
    return True


def _is_the_file(handle: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(handle), os.stat(path))
    except FileNotFoundError:
        return False


def _told(handle: int) -> Owner | None:
    try:
        os.lseek(handle, 0, os.SEEK_SET)
        return Owner.parse(os.read(handle, 4096))
    except OSError:  # Windows and some shares do not let a locked file be read
        return None
